//! Six missions for a surface craft that the planner has not met, each within what it can do.

use std::sync::Arc;

use sim::{
    scenario::{AuvFile, DiveFile, PathFile, Point, Quantity, RandomCraftFile, Scenario, SurfaceClassFile},
    surface_craft::{
        SurfaceClass,
        random::{CraftWishes, NoCraft, RandomCraft},
    },
};

/// How long each lasts, s.
pub const DURATION: f64 = 900.0;
/// Speed over the horizontal of the fast AUV, m/s, for a craft that is fast enough.
const FAST: f64 = 0.9;
/// The share of the craft's speed that the fast AUV has at most.
const FAST_SHARE: f64 = 0.6;
/// Pitch of the fast AUV's dives, rad: 0.9 m/s over the horizontal take no more along the body than it has.
const FAST_PITCH: f64 = 0.2;
/// Depths of its dives, m.
const FAST_DEPTHS: [f64; 2] = [1.0, 8.0];
/// Length of its lanes and their distance, m: turns of 20 m, at 0.9 m/s 0.045 rad/s.
const FAST_LANE: f64 = 120.0;
/// As above.
const FAST_SPACING: f64 = 40.0;
/// Its lanes: more than [`DURATION`] at [`FAST`].
const FAST_LANES: usize = 6;

/// What a mission of [`Stranger`] is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrangerMission {
    /// One AUV at up to 0.9 m/s, from above it.
    FastAuv,
    /// One AUV at 0.19 m/s, from 17 m off.
    SlowAuv,
    /// Two slow ones in turn.
    Switching,
    /// The midpoint of two slow ones in 0.12 m/s of unknown current, sensors erring.
    Midpoint,
    /// One slow one, from 40 m ahead of it, facing back.
    AboutFace,
    /// One slow one that is heard of every 10 s, late and inexactly.
    NoisyFixes,
}

/// A craft of a seed, and its missions.
#[derive(Clone, Debug, PartialEq)]
pub struct Stranger {
    /// The seed.
    pub seed: u64,
    /// The craft.
    pub craft: Arc<RandomCraft>,
}

impl StrangerMission {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::FastAuv,
        Self::SlowAuv,
        Self::Switching,
        Self::Midpoint,
        Self::AboutFace,
        Self::NoisyFixes,
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::FastAuv => "stranger-fast-auv",
            Self::SlowAuv => "stranger-slow-auv",
            Self::Switching => "stranger-switching",
            Self::Midpoint => "stranger-midpoint",
            Self::AboutFace => "stranger-about-face",
            Self::NoisyFixes => "stranger-noisy-fixes",
        }
    }

    /// The built-in scenario that it is like.
    fn model(self) -> &'static str {
        match self {
            Self::FastAuv => "calm",
            Self::SlowAuv => "paper-tracking",
            Self::Switching => "switching",
            Self::Midpoint => "paper-midpoint",
            Self::AboutFace => "about-face",
            Self::NoisyFixes => "noisy-fixes",
        }
    }

    /// The mission for a craft of a class that is known.
    #[must_use]
    pub(crate) fn for_class(self, class: SurfaceClass) -> Scenario {
        let mut scenario = self.for_speed(class.limits().speed_max);
        let file = scenario.surface_craft.as_mut().expect("every model has one");
        file.class = match class {
            SurfaceClass::Medusa => SurfaceClassFile::Medusa,
            SurfaceClass::Otter => SurfaceClassFile::Otter,
        };
        scenario
    }

    /// The mission for a craft of that top speed, m/s, whatever its class.
    fn for_speed(self, speed_max: f64) -> Scenario {
        let mut scenario = built_in(self.model()).lasting(DURATION);
        self.name().clone_into(&mut scenario.name);
        let file = scenario.surface_craft.as_mut().expect("every model has one");
        match self {
            Self::FastAuv => {
                let speed = FAST.min(FAST_SHARE * speed_max);
                file.speed_mps = Quantity::fixed(speed);
                fast(&mut scenario.auvs[0], speed);
            }
            Self::Midpoint => {
                let unknown = built_in("cross-current-unknown");
                scenario.water = unknown.water;
                scenario.knowledge = unknown.knowledge;
            }
            Self::SlowAuv | Self::Switching | Self::AboutFace | Self::NoisyFixes => {}
        }
        scenario
    }
}

impl Stranger {
    /// The craft of `seed`.
    pub fn draw(seed: u64) -> Result<Self, NoCraft> {
        RandomCraft::draw(seed, &CraftWishes::default()).map(|craft| Self {
            seed,
            craft: Arc::new(craft),
        })
    }

    /// One of its missions. The scenario's title says which craft flies it.
    #[must_use]
    pub fn scenario(&self, mission: StrangerMission) -> Scenario {
        let mut scenario = mission.for_speed(self.craft.tested.limits.speed_max);
        scenario.title = format!("craft {}: {}", self.seed, scenario.title);
        let file = scenario.surface_craft.as_mut().expect("every model has one");
        file.class = SurfaceClassFile::Random(RandomCraftFile {
            seed: Some(self.seed),
            ..RandomCraftFile::default()
        });
        file.drawn = Some(self.craft.clone());
        scenario
    }
}

fn built_in(name: &str) -> Scenario {
    Scenario::named(name).expect("it is built in")
}

/// Makes an AUV a fast AUV on wide lanes.
fn fast(auv: &mut AuvFile, horizontal_speed: f64) {
    let [depth_min, depth_max] = FAST_DEPTHS;
    auv.speed_mps = Some(Quantity::fixed(horizontal_speed / FAST_PITCH.cos()));
    auv.dive = Some(DiveFile {
        depth_min_m: Quantity::fixed(depth_min),
        depth_max_m: Quantity::fixed(depth_max),
        pitch_rad: Quantity::fixed(FAST_PITCH),
    });
    auv.path = PathFile::LawnMower {
        from: Point(vec![Quantity::fixed(0.0), Quantity::fixed(0.0)]),
        heading_rad: Quantity::fixed(0.0),
        lane_length_m: Quantity::fixed(FAST_LANE),
        lane_spacing_m: Quantity::fixed(FAST_SPACING),
        lanes: FAST_LANES,
    };
}
