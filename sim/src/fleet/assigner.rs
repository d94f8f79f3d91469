//! Who serves whom: the planner's assignment, and rules to compare it with.

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Rounds of k-means, more than a few craft need.
const ROUNDS: usize = 20;

/// What assigns AUVs to several craft. Whatever it is, the planner plans for each one's part.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Assigner {
    /// The planner.
    #[default]
    Planner,
    /// The first craft has all AUVs; the others stay where they are.
    One,
    /// Each AUV has the nearest craft, anew each minute.
    Nearest,
    /// A sequential auction of single AUVs by distance, anew each minute.
    Auction,
    /// Territories by k-means, anew each minute.
    Territories,
    /// The craft of each AUV, by number, always.
    Fixed(Vec<usize>),
}

impl Assigner {
    /// The rules that it is compared with, without the fixed ones.
    pub const RULES: [Self; 4] = [Self::One, Self::Nearest, Self::Auction, Self::Territories];

    /// Name of its controller in records.
    pub fn guide(&self) -> &'static str {
        match self {
            Self::Planner => "mpc",
            Self::One => "one",
            Self::Nearest => "nearest",
            Self::Auction => "auction",
            Self::Territories => "territories",
            Self::Fixed(_) => "fixed",
        }
    }

    /// The craft of each AUV, by index, of those at these positions (north, east), m; `may_serve`
    /// tells which may serve which. None by the planner, which needs more than positions.
    pub fn assign(
        &self,
        craft: &[Vector2<f64>],
        auvs: &[Vector2<f64>],
        may_serve: &dyn Fn(usize, usize) -> bool,
    ) -> Vec<Option<usize>> {
        let able = |auv: usize| (0..craft.len()).filter(move |k| may_serve(*k, auv));
        let nearest = |places: &[Vector2<f64>], auv: usize| {
            let distance = |k: &usize| (places[*k] - auvs[auv]).norm();
            able(auv).min_by(|a, b| distance(a).total_cmp(&distance(b)))
        };
        let each = 0..auvs.len();
        match self {
            Self::Planner => vec![None; auvs.len()],
            Self::One => each.map(|auv| able(auv).find(|k| *k == 0)).collect(),
            Self::Fixed(of) => each.map(|auv| of.get(auv).copied().filter(|k| *k < craft.len())).collect(),
            Self::Nearest => each.map(|auv| nearest(craft, auv)).collect(),
            Self::Auction => auctioned(craft, auvs, may_serve),
            Self::Territories => {
                let mut centres = craft.to_vec();
                for _ in 0..ROUNDS {
                    let of: Vec<_> = each.clone().map(|auv| nearest(&centres, auv)).collect();
                    for (k, centre) in centres.iter_mut().enumerate() {
                        let own = auvs.iter().zip(&of).filter(|(_, of)| **of == Some(k));
                        let (sum, n) =
                            own.fold((Vector2::zeros(), 0.0), |(sum, n), (at, _)| (sum + at, n + 1.0));
                        if 0.0 < n {
                            *centre = sum / n;
                        }
                    }
                }
                each.map(|auv| nearest(&centres, auv)).collect()
            }
        }
    }
}

/// Each craft bids its way to an AUV after those that it won; the least bid of all wins.
fn auctioned(
    craft: &[Vector2<f64>],
    auvs: &[Vector2<f64>],
    may_serve: &dyn Fn(usize, usize) -> bool,
) -> Vec<Option<usize>> {
    let (mut ends, mut spent) = (craft.to_vec(), vec![0.0; craft.len()]);
    let mut of = vec![None; auvs.len()];
    for _ in auvs {
        let open = (0..auvs.len()).filter(|auv| of[*auv].is_none());
        let bids = open.flat_map(|auv| {
            let bidders = (0..craft.len()).filter(move |k| may_serve(*k, auv));
            let (ends, spent) = (&ends, &spent);
            bidders.map(move |k| (spent[k] + (ends[k] - auvs[auv]).norm(), auv, k))
        });
        let Some((bid, auv, k)) = bids.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        (of[auv], ends[k], spent[k]) = (Some(k), auvs[auv], bid);
    }
    of
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(places: &[f64]) -> Vec<Vector2<f64>> {
        places.iter().map(|north| Vector2::new(*north, 0.0)).collect()
    }

    #[test]
    fn rules_differ_where_one_craft_is_near_to_all() {
        let (craft, auvs) = (line(&[0.0, 100.0]), line(&[-10.0, 41.0, 45.0, 300.0]));
        let assigned = |rule: Assigner| {
            rule.assign(&craft, &auvs, &|_, _| true).into_iter().map(Option::unwrap).collect::<Vec<_>>()
        };
        assert_eq!(assigned(Assigner::One), [0, 0, 0, 0]);
        assert_eq!(assigned(Assigner::Nearest), [0, 0, 0, 1]);
        // The first craft wins −10 m for 10, and then bids 61 for 41 m; the other bids 55 for
        // 45 m, and then 59.
        assert_eq!(assigned(Assigner::Auction), [0, 1, 1, 1]);
        // Means of −10, 41, 45 and of 300 m: every AUV is nearest to that of its own.
        assert_eq!(assigned(Assigner::Territories), [0, 0, 0, 1]);
        assert_eq!(assigned(Assigner::Fixed(vec![1, 0, 0, 1])), [1, 0, 0, 1]);
    }

    #[test]
    fn an_auv_that_no_craft_may_serve_has_none() {
        let (craft, auvs) = (line(&[0.0, 100.0]), line(&[0.0, 100.0]));
        for rule in [Assigner::Nearest, Assigner::Auction, Assigner::Territories] {
            let of = rule.assign(&craft, &auvs, &|k, auv| k == 1 && auv == 0);
            assert_eq!(of, [Some(1), None], "{rule:?}");
        }
    }
}
