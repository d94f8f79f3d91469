//! Known craft: the only vessel data in the planner.

use crate::craft::closed_loop::{
    Craft, HeadingDynamics, HeadingReference, HeadingResponse, Power, SpeedReference, SurgeResponse,
};

impl Craft {
    /// MEDUSA class, drag feed-forward on.
    ///
    /// Source: public parameters of the laboratory's craft (IST Lisbon), closed loops as simulated
    /// here. Heading: 2ζ/ω with ω = 1.6 rad/s, ζ = 0.8. Surge: 63 % of a step from 0.3 to 0.7 m/s
    /// take 2.5 s; the clamped proportional part, 26 N/(m/s) · 0.2 m/s, gives 50 kg 0.104 m/s² at
    /// rest and 0.085 m/s² at 1.4 m/s; integral time k_p/k_i = 26/3 s. Drift: m_u/d_v = 50 kg /
    /// 55.1 kg/s. Power: quadratic surge drag, 27.5 N/(m/s)².
    pub const MEDUSA: Self = Self {
        heading: HeadingResponse {
            dynamics: HeadingDynamics::SecondOrder { natural_frequency: 1.6, damping: 0.8 },
            delay: 0.0,
            rate_max: 0.3,
        },
        surge: SurgeResponse {
            time_constant: 2.5,
            delay: 0.0,
            acceleration_max: 0.09,
            deceleration_max: 0.09,
            integral_time: Some(26.0 / 3.0),
        },
        sway_per_yaw_rate: 50.0 / 55.1,
        power: Power { linear_w_per_mps: 0.0, cubic_w_per_mps3: 27.5 },
        speed_held: SpeedReference::ThroughWater,
        heading_held: HeadingReference::Heading,
    };

    /// Maritime Robotics Otter, 80 kg, drag feed-forward on.
    ///
    /// Source: `otter.py` of T. I. Fossen's Python Vehicle Simulator, closed loops as simulated
    /// here. Turn rate: 0.2 rad/s take 27 N m, which leaves thrust for 2.0 m/s. Surge: ramps at 0.2
    /// m/s² are followed 1.4 to 1.7 s behind, a step from 0.3 to 0.7 m/s takes 1.9 s; 44.5 N/(m/s)
    /// · 0.4 m/s on 85.5 kg. Drift: 80 kg / 162.5 kg/s. Power: linear surge drag of 77.6 N/(m/s),
    /// fitted at 1 and 2 m/s.
    pub const OTTER: Self = Self {
        heading: HeadingResponse {
            dynamics: HeadingDynamics::SecondOrder { natural_frequency: 1.6, damping: 0.8 },
            delay: 0.0,
            rate_max: 0.2,
        },
        surge: SurgeResponse {
            time_constant: 2.0,
            delay: 0.0,
            acceleration_max: 0.20,
            deceleration_max: 0.20,
            integral_time: Some(44.5 / 5.1),
        },
        sway_per_yaw_rate: 80.0 / 162.5,
        power: Power { linear_w_per_mps: 51.7, cubic_w_per_mps3: 25.9 },
        speed_held: SpeedReference::ThroughWater,
        heading_held: HeadingReference::Heading,
    };

    /// The default craft. It turns and accelerates more slowly than most small craft, so that a
    /// plan asks for less than an unknown craft can do until it is learnt.
    ///
    /// Source: chosen among the small craft that the simulator generates (heading lags of 0.5 to 8
    /// s, accelerations of 0.03 to 0.8 m/s²), on the cautious side of the middle.
    pub const GENERIC: Self = Self {
        heading: HeadingResponse {
            dynamics: HeadingDynamics::FirstOrder { time_constant: 2.0 },
            delay: 1.0,
            rate_max: 0.15,
        },
        surge: SurgeResponse {
            time_constant: 2.0,
            delay: 1.0,
            acceleration_max: 0.06,
            deceleration_max: 0.06,
            integral_time: None,
        },
        sway_per_yaw_rate: 0.8,
        power: Power { linear_w_per_mps: 0.0, cubic_w_per_mps3: 40.0 },
        speed_held: SpeedReference::ThroughWater,
        heading_held: HeadingReference::Heading,
    };
}

/// All known craft; the first is the default.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "generic",
        title: "a cautious small craft, for one without a description",
        source: "chosen on the cautious side of small craft between 20 and 500 kg; no vessel",
        craft: Craft::GENERIC,
    },
    Preset {
        name: "medusa",
        title: "MEDUSA class: 30 kg, 1.6 m/s, drag feed-forward on",
        source: "public parameters of the craft of the Institute for Systems and Robotics, Lisbon; its loops as simulated here",
        craft: Craft::MEDUSA,
    },
    Preset {
        name: "otter",
        title: "Maritime Robotics Otter with 25 kg of payload: 80 kg, 3 m/s, drag feed-forward on",
        source: "T. I. Fossen, Python Vehicle Simulator, otter.py; its loops as simulated here",
        craft: Craft::OTTER,
    },
];

/// A known craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// Its name in requests.
    pub name: &'static str,
    /// Description.
    pub title: &'static str,
    /// Source of its numbers.
    pub source: &'static str,
    /// Its response.
    pub craft: Craft,
}

impl Preset {
    /// The craft of that name.
    pub fn named(name: &str) -> Option<&'static Self> {
        PRESETS.iter().find(|preset| preset.name == name)
    }
}
