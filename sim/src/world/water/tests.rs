use std::f64::consts::FRAC_PI_2;

use super::*;

const SURFACE: f64 = 0.0;

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(5)
}

fn everything() -> WaterSetup {
    WaterSetup {
        gauss_markov: Some(GaussMarkov {
            sigma: 0.05,
            correlation_time: 300.0,
        }),
        shear: Some(Shear {
            depth: 20.0,
            factor: 0.5,
            turn: FRAC_PI_2,
        }),
        waves: Some(Waves {
            heading_sigma: 0.05,
            surge_sigma: 0.1,
            peak_period: 3.0,
            damping: 0.1,
        }),
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
fn equal_seeds_give_equal_water_and_other_seeds_other_water() {
    let run = |seed| {
        let mut water = Water::new(&everything(), ChaCha8Rng::seed_from_u64(seed));
        for _ in 0..100 {
            water.step();
        }
        (water.current(&Vector2::zeros(), 7.0), water.wave_acceleration())
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(2).0);
    assert_ne!(run(1).1, run(2).1);
}

#[test]
fn waves_and_fluctuation_do_not_change_each_other() {
    let calm = WaterSetup {
        waves: None,
        ..everything()
    };
    let steady = WaterSetup {
        gauss_markov: None,
        ..everything()
    };
    let [mut all, mut calm, mut steady] = [everything(), calm, steady].map(|setup| Water::new(&setup, rng()));
    for _ in 0..100 {
        for water in [&mut all, &mut calm, &mut steady] {
            water.step();
        }
    }
    let current = |water: &Water| water.current(&Vector2::zeros(), SURFACE);
    assert_eq!(current(&all), current(&calm));
    assert_eq!(all.wave_acceleration(), steady.wave_acceleration());
    assert_ne!(current(&all), current(&steady));
}

#[test]
fn shear_keeps_the_surface_and_is_complete_from_its_depth_down() {
    let shear = Shear {
        depth: 20.0,
        factor: 0.5,
        turn: FRAC_PI_2,
    };
    let north = Vector2::new(0.4, 0.0);
    assert_eq!(shear.apply(north, SURFACE), north);
    assert_eq!(shear.apply(north, -1.0), north, "above the surface");
    // Clockwise by a right angle: north becomes east.
    let below = Vector2::new(0.0, 0.2);
    assert!((shear.apply(north, 20.0) - below).norm() < 1e-15);
    assert_eq!(shear.apply(north, 20.0), shear.apply(north, 500.0));
    // Half-way: 45° clockwise, three quarters of the speed.
    let half = shear.apply(north, 10.0);
    assert!((half.norm() - 0.3).abs() < 1e-15 && (half.x - half.y).abs() < 1e-15);
}

#[test]
fn shear_acts_on_mean_and_fluctuation_alike() {
    let water = Water::new(&everything(), rng());
    let surface = water.current(&Vector2::zeros(), SURFACE);
    assert_ne!(surface, Vector2::new(0.1, -0.2));
    let below = water.current(&Vector2::zeros(), 30.0);
    assert!((below - 0.5 * Vector2::new(-surface.y, surface.x)).norm() < 1e-15);
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
