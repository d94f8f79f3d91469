use std::f64::consts::FRAC_PI_2;

use super::*;
use crate::tests::near_to;

const SURFACE: f64 = 0.0;

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(5)
}

const SHEAR: Shear = Shear { depth: 20.0, factor: 0.5, turn: FRAC_PI_2 };

fn everything() -> WaterSetup {
    WaterSetup {
        gauss_markov: Some(GaussMarkov { sigma: 0.05, correlation_time: 300.0 }),
        shear: Some(SHEAR),
        waves: Some(Waves { heading_sigma: 0.05, surge_sigma: 0.1, peak_period: 3.0, damping: 0.1 }),
        ..WaterSetup::constant(Vector2::new(0.1, -0.2))
    }
}

#[test]
fn a_constant_current_alone_is_exact_to_the_bit() {
    let constant = Vector2::new(-0.0, 0.1 + 0.2);
    let mut water = Water::new(&WaterSetup::constant(constant), rng());
    for depth in [SURFACE, 20.0] {
        water.step();
        let bits = water.current(&Vector2::new(3.0, 4.0), depth).map(f64::to_bits);
        assert_eq!(bits, constant.map(f64::to_bits));
    }
    assert_eq!(water.wave_acceleration(), WaveAcceleration::default());
}

#[test]
fn waves_and_fluctuation_do_not_change_each_other() {
    let (mut calm, mut steady) = (everything(), everything());
    (calm.waves, steady.gauss_markov) = (None, None);
    let [all, calm, steady] = [everything(), calm, steady].map(|setup| {
        let mut water = Water::new(&setup, rng());
        (0..100).for_each(|_| water.step());
        (water.current(&Vector2::zeros(), SURFACE), water.wave_acceleration())
    });
    assert_eq!((all.0, all.1), (calm.0, steady.1));
    assert_ne!(all.0, steady.0);
}

#[test]
fn shear_keeps_the_surface_and_is_complete_from_its_depth_down() {
    let north = Vector2::new(0.4, 0.0);
    assert_eq!(SHEAR.apply(north, SURFACE), north);
    assert_eq!(SHEAR.apply(north, -1.0), north, "above the surface");
    // Clockwise by a right angle: north becomes east.
    near_to(SHEAR.apply(north, 20.0), Vector2::new(0.0, 0.2), 1e-15);
    assert_eq!(SHEAR.apply(north, 20.0), SHEAR.apply(north, 500.0));
    // Half-way: 45° clockwise, three quarters of the speed.
    let expected = Vector2::new(1.0, 1.0).normalize() * 0.3;
    near_to(SHEAR.apply(north, 10.0), expected, 1e-15);
}

#[test]
fn shear_acts_on_mean_and_fluctuation_alike() {
    let water = Water::new(&everything(), rng());
    let surface = water.current(&Vector2::zeros(), SURFACE);
    assert_ne!(surface, Vector2::new(0.1, -0.2));
    let below = water.current(&Vector2::zeros(), 30.0);
    near_to(below, 0.5 * Vector2::new(-surface.y, surface.x), 1e-15);
}

#[test]
fn a_gridded_current_follows_the_time_of_the_water() {
    let table = "t_s,north_m,east_m,current_north_mps,current_east_mps\n0,0,0,0,0\n10,0,0,1,-1\n";
    let grid = CurrentGrid::read(table.as_bytes()).expect("two nodes");
    let setup = WaterSetup {
        current: MeanCurrent::Gridded(Arc::new(grid)),
        ..WaterSetup::constant(Vector2::zeros())
    };
    let mut water = Water::new(&setup, rng());
    for _ in 0..50 {
        water.step();
    }
    assert_eq!(water.current(&Vector2::zeros(), SURFACE), Vector2::new(0.5, -0.5));
}
