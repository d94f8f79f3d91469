//! The missions of a bench as jobs, and their answers as a board.

use planner::los::{LosLaw, LosTuning};

use super::{
    Bench, BenchError, Board, Contender, Entry, Family, Flown, Match, Pilot, Score, TUNING_SEED, fly,
    queue::in_parallel,
};
use crate::{regret::regret, tuning::grid};
use sim::record::Record;

/// What the planner's run takes beside a law's, for progress. Measured: 1.2 to 6 s beside 10 to 70 ms.
const PLANNER_COST: f64 = 100.0;

/// What the clairvoyant's program takes beside a law's run. Measured: 10 to 80 ms.
const BOUND_COST: f64 = 4.0;

/// One mission, or the missions of one point of a grid.
struct Job {
    scenario: usize,
    kind: JobKind,
}

enum JobKind {
    /// Means of the objectives of [`Family::ALL`] at gains, over the tuning seeds.
    Tune { contender: usize, tuning: LosTuning },
    /// A score.
    Fly {
        contender: usize,
        tuning: Option<LosTuning>,
        seed: u64,
    },
    /// The clairvoyant's bound.
    Bound { seed: u64 },
}

enum Answer {
    Objectives([f64; 3]),
    Score(Box<Score>),
    Bound(Option<f64>),
}

impl Bench {
    /// Runs everything. `progress` gets the fraction done, by expected work.
    pub fn run(&self, progress: &mut (dyn FnMut(f64) + Send)) -> Result<Board, BenchError> {
        if let Some(scenario) = self
            .scenarios
            .iter()
            .find(|scenario| !scenario.has_surface_craft())
        {
            return Err(BenchError::NoSurfaceCraft {
                scenario: scenario.name.clone(),
            });
        }
        let tuning = self.tuning_jobs();
        let all: f64 = tuning.iter().map(|job| self.cost(job)).sum::<f64>() + self.scoring_cost();
        let mut done = 0.0;
        let mut tell = |job: &Job, _: &Result<Answer, BenchError>| {
            done += self.cost(job) / all;
            progress(done.min(1.0));
        };
        let answers = in_parallel(&tuning, self.threads, |job| self.work(job), &mut tell)?;
        let gains = best_gains(&tuning, &answers);
        let scoring = self.scoring_jobs(&gains);
        let answers = in_parallel(&scoring, self.threads, |job| self.work(job), &mut tell)?;
        Ok(self.board(&scoring, &answers, &gains))
    }

    fn takes_part(&self, scenario: usize) -> impl Iterator<Item = (usize, &Contender)> {
        let contenders = self.contenders.iter().enumerate();
        contenders.filter(move |(_, contender)| contender.takes_part(&self.scenarios[scenario]))
    }

    /// A controller that takes part in `scenario`, if all fly the same plant in the same world; none where some do not.
    fn anyone(&self, scenario: usize) -> Option<&Contender> {
        let mut all = self.takes_part(scenario).map(|(_, contender)| contender);
        let first = all.next()?;
        all.all(|contender| contender.variation == first.variation)
            .then_some(first)
    }

    fn tuning_jobs(&self) -> Vec<Job> {
        let mut jobs = vec![];
        for scenario in 0..self.scenarios.len() {
            for (contender, entry) in self.takes_part(scenario) {
                let Pilot::Law(law) = entry.pilot else { continue };
                jobs.extend(grid(law).into_iter().map(|tuning| Job {
                    scenario,
                    kind: JobKind::Tune { contender, tuning },
                }));
            }
        }
        jobs
    }

    /// The planner's runs first, so that the last thread to end ends with a short one.
    fn scoring_jobs(&self, gains: &Gains) -> Vec<Job> {
        let mut jobs = vec![];
        for seed in 1..=self.seeds {
            for scenario in 0..self.scenarios.len() {
                for (contender, _) in self.takes_part(scenario) {
                    for tuning in distinct(gains.of(scenario, contender)) {
                        jobs.push(Job {
                            scenario,
                            kind: JobKind::Fly {
                                contender,
                                tuning,
                                seed,
                            },
                        });
                    }
                }
                if self.anyone(scenario).is_some() {
                    jobs.push(Job {
                        scenario,
                        kind: JobKind::Bound { seed },
                    });
                }
            }
        }
        // Stable: the same order each time.
        jobs.sort_by(|a, b| self.cost(b).total_cmp(&self.cost(a)));
        jobs
    }

    /// Expected work, in missions of a law.
    #[expect(clippy::cast_precision_loss, reason = "thousands of seeds, not 2⁵³")]
    fn cost(&self, job: &Job) -> f64 {
        match job.kind {
            JobKind::Tune { .. } => self.tuning_seeds as f64,
            JobKind::Fly { contender, .. } => match self.contenders[contender].pilot {
                Pilot::Law(_) | Pilot::Tuned(_) => 1.0,
                Pilot::Planner { .. } => PLANNER_COST,
            },
            JobKind::Bound { .. } => BOUND_COST,
        }
    }

    /// Expected work of all that is scored, each law at the same gains for all families.
    fn scoring_cost(&self) -> f64 {
        let untuned = self.scoring_jobs(&Gains::default());
        untuned.iter().map(|job| self.cost(job)).sum()
    }

    fn work(&self, job: &Job) -> Result<Answer, BenchError> {
        let scenario = &self.scenarios[job.scenario];
        match job.kind {
            JobKind::Tune { contender, tuning } => {
                let contender = &self.contenders[contender];
                let mut sums = [0.0; 3];
                for seed in TUNING_SEED..TUNING_SEED + self.tuning_seeds {
                    let score = scored(&fly(contender, Some(tuning), scenario, seed)?);
                    for (sum, family) in sums.iter_mut().zip(Family::ALL) {
                        *sum += family.objective().of(&score);
                    }
                }
                Ok(Answer::Objectives(sums))
            }
            JobKind::Fly {
                contender,
                tuning,
                seed,
            } => {
                let record = fly(&self.contenders[contender], tuning, scenario, seed)?;
                Ok(Answer::Score(Box::new(scored(&record))))
            }
            JobKind::Bound { seed } => {
                // Where the goal went, in which current and on which plant, is the same under every controller.
                let anyone = Contender {
                    variation: self
                        .anyone(job.scenario)
                        .and_then(|contender| contender.variation),
                    ..Contender::law(LosLaw::SaturatedLos)
                };
                let record = fly(&anyone, None, scenario, seed)?;
                let bound = regret(&record).ok().flatten().map(|regret| regret.bound_rms_m);
                Ok(Answer::Bound(bound))
            }
        }
    }

    fn board(&self, jobs: &[Job], answers: &[Answer], gains: &Gains) -> Board {
        let matches = (0..self.scenarios.len()).map(|index| {
            let scenario = &self.scenarios[index];
            let answered = || {
                jobs.iter()
                    .zip(answers)
                    .filter(move |(job, _)| job.scenario == index)
            };
            let entries = self.takes_part(index).map(|(number, contender)| Entry {
                contender: contender.clone(),
                flown: gains.of(index, number).map(|wanted| {
                    let scores = answered().filter_map(|(job, answer)| match (&job.kind, answer) {
                        (
                            JobKind::Fly {
                                contender, tuning, ..
                            },
                            Answer::Score(score),
                        ) if *contender == number && *tuning == wanted => Some(Score::clone(score)),
                        _ => None,
                    });
                    Flown {
                        tuning: wanted,
                        scores: scores.collect(),
                    }
                }),
            });
            let bounds = answered().filter_map(|(_, answer)| match answer {
                Answer::Bound(bound) => Some(*bound),
                Answer::Objectives(_) | Answer::Score(_) => None,
            });
            let bounds: Option<Vec<f64>> = bounds.collect();
            Match {
                scenario: scenario.name.clone(),
                title: scenario.title.clone(),
                paths_known: scenario.knowledge.paths,
                entries: entries.collect(),
                bound_rms_m: bounds.filter(|bounds| !bounds.is_empty()),
            }
        });
        Board {
            seeds: (1..=self.seeds).collect(),
            matches: matches.collect(),
        }
    }
}

fn scored(record: &Record) -> Score {
    Score::of(record).expect("a bench refuses scenarios without a surface craft")
}

/// The best gains of every law: scenario, contender, gains by family.
#[derive(Default)]
struct Gains(Vec<(usize, usize, [LosTuning; 3])>);

impl Gains {
    /// By family; none where nothing was tuned.
    fn of(&self, scenario: usize, contender: usize) -> [Option<LosTuning>; 3] {
        let mut tuned = self.0.iter();
        match tuned.find(|(s, c, _)| (*s, *c) == (scenario, contender)) {
            Some((_, _, tunings)) => tunings.map(Some),
            None => [None; 3],
        }
    }
}

/// Of equals the first of the grid.
fn best_gains(jobs: &[Job], answers: &[Answer]) -> Gains {
    let mut best: Vec<(usize, usize, [LosTuning; 3])> = vec![];
    let mut least = [f64::INFINITY; 3];
    for (job, answer) in jobs.iter().zip(answers) {
        let (JobKind::Tune { contender, tuning }, Answer::Objectives(objectives)) = (&job.kind, answer)
        else {
            continue;
        };
        if best
            .last()
            .is_none_or(|(s, c, _)| (*s, *c) != (job.scenario, *contender))
        {
            best.push((job.scenario, *contender, [*tuning; 3]));
            least = [f64::INFINITY; 3];
        }
        let (_, _, tunings) = best.last_mut().expect("pushed just before");
        for i in 0..3 {
            if objectives[i] < least[i] {
                (least[i], tunings[i]) = (objectives[i], *tuning);
            }
        }
    }
    Gains(best)
}

/// Without those that come earlier already.
fn distinct(tunings: [Option<LosTuning>; 3]) -> Vec<Option<LosTuning>> {
    let mut distinct = vec![];
    for tuning in tunings {
        if !distinct.contains(&tuning) {
            distinct.push(tuning);
        }
    }
    distinct
}
