//! Bounds of the craft's position.

use nalgebra::Vector2;

use crate::problem::limits::{sag, sag_in_turn};
use crate::program::{build::Program, layout::Slack, subproblem::Subproblem, units::LENGTH_UNIT};

impl Program {
    /// The craft stays in acoustic range: ‖p_k − p_i,k‖ ≤ ρ_i,k + ξ for every AUV i. Exact, as
    /// depth and covariance are forecast and ρ includes their back-off. AUVs that the goal names
    /// have their own slack, with a higher price.
    pub(crate) fn acoustic_ranges(&mut self, subproblem: &Subproblem<'_>) {
        for (i, range) in subproblem.ranges.iter().enumerate() {
            for k in self.stages() {
                let row = self.layout.range_cone(k, i);
                self.bounds[row] = range.radii[k] / LENGTH_UNIT;
                let slack = if range.named { Slack::AcousticRange } else { Slack::OtherRange };
                self.soften(row, k, slack, LENGTH_UNIT);
                self.add_axes(row + 1, self.layout.deviation(k), -1.0);
                self.bound(row + 1, (subproblem.goal[k] - range.centres[k]) / LENGTH_UNIT);
            }
        }
    }

    /// The craft stays in the area: n_gᵀ p_k ≤ b_g + ξ for every edge g; convex between stages.
    pub(crate) fn area(&mut self, subproblem: &Subproblem<'_>) {
        for (g, edge) in subproblem.edges.iter().enumerate() {
            for k in self.stages() {
                let row = self.layout.area(k, g);
                self.add_deviation(row, k, edge.normal);
                self.soften(row, k, Slack::Area, LENGTH_UNIT);
                self.bounds[row] = (edge.offset - edge.normal.dot(&subproblem.goal[k])) / LENGTH_UNIT;
            }
        }
    }

    /// The craft keeps out of the discs: n_oᵀ (p − c_o) ≥ R_o + Δt² ‖a‖_max / 8 − ξ at both ends of
    /// every interval, with one normal: the chord stays out, and by the last term also the arc that
    /// sags from it. No limit if the disc is inactive at both ends (R_o < 0).
    pub(crate) fn keep_outs(&mut self, subproblem: &Subproblem<'_>) {
        for (o, disc) in subproblem.discs.iter().enumerate() {
            for k in self.stages() {
                let (end, start) = (self.layout.disc_at_end(k, o), k - 1);
                // Rows of an inactive disc hold everywhere: 0 ≥ −1 − ξ.
                let there = disc.radii[start].max(disc.radii[k]) >= 0.0;
                let normal = if there { disc.normals[k] } else { Vector2::zeros() };
                let reach = |at: usize| {
                    if there {
                        disc.radii[at] + sag(subproblem.steps[k - 1], subproblem.limits)
                    } else {
                        -LENGTH_UNIT
                    }
                };
                self.outside(end, k, k, normal, disc.centres[k], reach(k), subproblem);
                if start > 0 {
                    let row = self.layout.disc_at_start(k, o);
                    let reach = reach(start);
                    self.outside(row, start, k, normal, disc.centres[start], reach, subproblem);
                }
            }
        }
    }

    /// The craft stays on its side of the half-planes beside no-go areas: nᵀ (p − c) ≥ margin + Δt²
    /// r_max u_max / 8 − ξ at both ends of every interval. They share the discs' rows and slack.
    pub(crate) fn shores(&mut self, subproblem: &Subproblem<'_>) {
        for (o, shore) in subproblem.shores.iter().enumerate() {
            let o = subproblem.discs.len() + o;
            for k in self.stages() {
                let (normal, point) = (shore.normals[k], shore.points[k]);
                // Without a limit the row holds everywhere.
                let there = normal != Vector2::zeros();
                let reach = if there {
                    shore.margin + sag_in_turn(subproblem.steps[k - 1], subproblem.limits)
                } else {
                    -LENGTH_UNIT
                };
                let end = self.layout.disc_at_end(k, o);
                self.outside(end, k, k, normal, point, reach, subproblem);
                if 1 < k {
                    let start = self.layout.disc_at_start(k, o);
                    self.outside(start, k - 1, k, normal, point, reach, subproblem);
                }
            }
        }
    }

    /// normalᵀ (p_at − centre) ≥ reach − ξ_k.
    #[expect(
        clippy::too_many_arguments,
        reason = "one row, said in full; a struct for it would say the same twice"
    )]
    fn outside(
        &mut self,
        row: usize,
        at: usize,
        k: usize,
        normal: Vector2<f64>,
        centre: Vector2<f64>,
        reach: f64,
        subproblem: &Subproblem<'_>,
    ) {
        self.add_deviation(row, at, -normal);
        self.soften(row, k, Slack::KeepOut, LENGTH_UNIT);
        self.bounds[row] = (normal.dot(&(subproblem.goal[at] - centre)) - reach) / LENGTH_UNIT;
    }
}
