//! Random surface craft and their step tests.

use nalgebra::Vector2;
use planner::angle::{Heading, wrap};
use planner::craft::{CraftDescription, HeadingDynamics, HeadingReference, SpeedReference};
use planner::los::Reference;
use sim::inner_loop::PERIOD;
use sim::scenario::{Files, Scenario};
use sim::surface_craft::random::{CraftConstraints, HeadingLoopKind, RandomCraft, SurgeLoopKind};
use sim::surface_craft::step_response::step_test;
use sim::surface_craft::{SurfaceClass, ThrusterHealth};
use sim::world::{Sea, SurfaceCraft};

fn craft(seed: u64) -> RandomCraft {
    RandomCraft::draw(seed, &CraftConstraints::default()).expect("a seed has a craft")
}

/// 248 was fitted an integrator that takes three days to wind up.
#[test]
fn results_of_step_tests_can_be_declared() {
    for seed in 1..40 {
        let declared = CraftDescription::from(&craft(seed).tested.craft);
        assert_eq!(declared.faults(), [], "craft {seed}");
    }
    let slow = craft(248);
    assert_eq!((slow.attempts, slow.tested.craft.surge.integral_time), (1, None));
}

#[test]
fn craft_of_every_kind_are_drawn_within_the_requested_ranges() {
    let all: Vec<RandomCraft> = (0..60).map(craft).collect();
    for craft in &all {
        let traits = &craft.traits;
        assert!((20.0..=500.0).contains(&traits.mass));
        assert!((0.5..=8.0).contains(&traits.heading_lag) && (0.5..=8.0).contains(&traits.surge_lag));
        assert!((0.03..=0.8).contains(&traits.acceleration));
        assert!((0.0..=2.0).contains(&traits.delay));
        // The thrusters have the force for the acceleration.
        let pull = 2.0 * craft.hull.thrusters.ahead_max / craft.hull.mass_surge;
        assert!(traits.acceleration < pull, "{pull}");
    }
    let any = |of: &dyn Fn(&RandomCraft) -> bool| all.iter().any(of);
    for kind in [
        HeadingLoopKind::ProportionalDerivative,
        HeadingLoopKind::ProportionalIntegralDerivative,
        HeadingLoopKind::ReferenceModel,
        HeadingLoopKind::Cascade,
    ] {
        assert!(any(&|craft| craft.traits.heading_loop == kind), "{kind:?}");
    }
    for kind in [SurgeLoopKind::Proportional, SurgeLoopKind::AntiWindup, SurgeLoopKind::Windup] {
        assert!(any(&|craft| craft.traits.surge_loop == kind), "{kind:?}");
    }
    let held = |craft: &RandomCraft| (craft.autopilot.heading_held, craft.autopilot.speed_held);
    assert!(any(&|craft| held(craft).0 == HeadingReference::Course));
    assert!(any(&|craft| held(craft).1 == SpeedReference::OverGround));
    assert!(any(&|craft| craft.traits.mass < 50.0) && any(&|craft| 200.0 < craft.traits.mass));
}

#[test]
fn the_medusa_s_step_tests_agree_with_its_gains() {
    let medusa = SurfaceClass::Medusa;
    let autopilot = medusa.autopilot(sim::inner_loop::DragFeedForward::On);
    let tested = step_test(&medusa.hull(), &autopilot).expect("it follows");
    // At 0.65 m/s the Munk moment (m_v − m_u) m_u u² / d_v takes a third of the loop's damping
    // 2ζω m_r, less quadratic yaw drag. Half a period and the thrusters' 0.1 s are added.
    let (damping, munk) = (2.0 * 0.8 * 1.6 * 4.64, 10.0 * 50.0 * 0.65 * 0.65 / 55.1);
    let least = (damping - munk) / (1.6 * 1.6 * 4.64);
    let most = least + 6.23 * 0.3 / (1.6 * 1.6 * 4.64) + 0.15;
    let found = tested.craft.heading.lag();
    assert!((least..most).contains(&found), "{found} s, not {least} to {most} s");
    // m_u / d_v for slow sway, less with its quadratic drag.
    let drift = tested.craft.sway_per_yaw_rate;
    assert!((0.5..50.0 / 55.1).contains(&drift), "{drift} s");
    // P = D_u(u) u = 27.5 u³.
    let power = tested.craft.power;
    assert!((power.cubic_w_per_mps3 - 27.5).abs() < 1e-9 && power.linear_w_per_mps.abs() < 1e-9);
    // The clamped proportional part, 26 N/(m/s) · 0.2 m/s on 50 kg, and its integral part.
    let acceleration = tested.craft.surge.acceleration_max;
    assert!((0.08..0.13).contains(&acceleration), "{acceleration} m/s²");
}

/// Distance of craft and response, rad and m/s, `duration` s after an unfitted reference.
fn apart(craft: &RandomCraft) -> (f64, f64) {
    let tested = &craft.tested;
    let (heading, surge) = (&tested.craft.heading, &tested.craft.surge);
    let cruise = 0.5 * tested.limits.speed_max;
    let at = |time: f64| -> (f64, f64) {
        // A zig-zag at half the fastest turn, and a speed that comes and goes.
        let rate = 0.5 * tested.limits.turn_rate_max;
        let phase = time % 40.0;
        let psi = rate * if phase < 20.0 { phase } else { 40.0 - phase };
        (cruise * (1.0 + 0.2 * (0.1 * time).sin()), psi)
    };
    let mut truth = SurfaceCraft::cruising(craft.hull, craft.autopilot, &Vector2::zeros(), 0.0, cruise);
    // A second route to the response: explicit Euler at a hundredth of a period.
    let (mut psi, mut rate, mut u, mut bias) = (0.0_f64, 0.0_f64, cruise, 0.0);
    let (mut worst, mut worst_speed): (f64, f64) = (0.0, 0.0);
    let fine = 0.01 * PERIOD;
    for k in 0..1000 {
        let time = PERIOD * f64::from(k);
        let drift = match craft.autopilot.heading_held {
            HeadingReference::Heading => 0.0,
            HeadingReference::Course => truth.state[4].atan2(truth.state[3]),
        };
        worst = worst.max(wrap(truth.state[2] + drift - psi).abs());
        worst_speed = worst_speed.max((truth.state[3] - u).abs());
        let (speed, asked) = at(time);
        let reference = Reference { speed, heading: Heading::new(asked) };
        truth.step(&reference, ThrusterHealth::SOUND, &Sea::calm());
        for i in 0..100 {
            let now = time + fine * f64::from(i);
            let wanted = at((now - heading.delay).max(0.0)).1;
            match heading.dynamics {
                HeadingDynamics::FirstOrder { time_constant } => rate = (wanted - psi) / time_constant,
                HeadingDynamics::SecondOrder { natural_frequency, damping } => {
                    rate += fine
                        * natural_frequency
                        * (natural_frequency * (wanted - psi) - 2.0 * damping * rate);
                }
            }
            rate = rate.clamp(-heading.rate_max, heading.rate_max);
            psi += fine * rate;
            let wanted = at((now - surge.delay).max(0.0)).0;
            let asked =
                ((wanted - u) / surge.time_constant).clamp(-surge.deceleration_max, surge.acceleration_max);
            u += fine * (asked + bias);
            bias += surge.integral_time.map_or(0.0, |time| fine * asked / time);
        }
    }
    (worst, worst_speed / tested.limits.speed_max)
}

#[test]
fn step_tests_predict_a_manoeuvre_that_they_did_not_contain() {
    // A loop with an integral part on its heading is behind a turn for a while, and then no more.
    let integral =
        |craft: &RandomCraft| craft.traits.heading_loop == HeadingLoopKind::ProportionalIntegralDerivative;
    for (with_integral, median, most) in [(false, 0.04, 0.15), (true, 0.2, 0.45)] {
        let all = (0..60).map(craft).filter(|craft| integral(craft) == with_integral);
        let (mut heading, mut speed): (Vec<f64>, Vec<f64>) = all.map(|craft| apart(&craft)).unzip();
        heading.sort_by(f64::total_cmp);
        speed.sort_by(f64::total_cmp);
        let (half, nine_tenths) = (heading.len() / 2, heading.len() * 9 / 10);
        println!(
            "integral {with_integral}: {:.3} and {:.3} rad, {:.3} and {:.3} of the top speed",
            heading[half], heading[nine_tenths], speed[half], speed[nine_tenths]
        );
        assert!(heading[half] < median && heading[nine_tenths] < most);
        assert!(speed[half] < 0.03 && speed[nine_tenths] < 0.1);
    }
}

#[test]
fn requested_properties_are_kept_and_the_others_are_drawn() {
    let wishes = CraftConstraints {
        mass: Some(300.0),
        heading_loop: Some(HeadingLoopKind::Cascade),
        heading_lag: Some(6.0),
        delay: Some(1.5),
        speed_held: Some(SpeedReference::OverGround),
        ..CraftConstraints::default()
    };
    let craft = RandomCraft::draw(3, &wishes).expect("there is one");
    assert!((craft.traits.mass - 300.0).abs() < 1e-12);
    assert_eq!(craft.traits.heading_loop, HeadingLoopKind::Cascade);
    assert_eq!(craft.autopilot.delay_periods, 15);
    assert_eq!(craft.autopilot.speed_held, SpeedReference::OverGround);
    let lag = craft.tested.craft.heading.lag();
    assert!((0.6 * 7.5..1.4 * 7.5).contains(&lag), "{lag} s");
}

fn with_class(class: &str) -> Result<Scenario, String> {
    let text = Scenario::text("calm").expect("exists");
    let text = text.replacen("class = \"medusa\"", class, 1);
    let read = Scenario::parse(&text, "my.toml", Files::default());
    read.and_then(Scenario::checked).map_err(|error| error.to_string())
}

#[test]
fn a_scenario_file_with_a_random_class_flies_a_craft_of_that_seed() {
    let scenario = with_class("class.random = {seed = 7, mass_kg = {uniform = [40, 60]}}").expect("right");
    let hull = |scenario: &Scenario, seed| {
        let start = scenario.start(seed).expect("valid");
        start.world.surface_craft.expect("has one").hull
    };
    assert_eq!(hull(&scenario, 1), hull(&scenario, 1));
    // The same craft with another mass, and another craft for every seed where none is named.
    assert_ne!(hull(&scenario, 1), hull(&scenario, 2));
    let any = with_class("class.random = {}").expect("right");
    assert_ne!(hull(&any, 1), hull(&any, 2));
    assert_eq!(hull(&any, 5), craft(5).hull);
    let one = with_class("class.random = {seed = 7}").expect("right");
    assert_eq!(hull(&one, 1), hull(&one, 2));
}

#[test]
fn an_invalid_random_class_is_named_with_its_limit() {
    for (wrong, says) in [
        ("mass_kg = 5", "5 is outside 20 to 500 kg"),
        ("heading_loop = \"fuzzy\"", "unknown variant `fuzzy`"),
        ("colour = 1", "colour"),
        ("seed = -1", "surface_craft.class"),
        ("delay_s = 3", "3 is outside 0 to 2 s"),
    ] {
        let error = with_class(&format!("class.random = {{{wrong}}}")).expect_err(wrong);
        assert!(error.contains(says) && error.starts_with("my.toml:"), "{wrong}: {error}");
    }
}
