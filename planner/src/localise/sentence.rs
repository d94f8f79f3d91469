//! One sentence that explains a figure.

use crate::facts::localise::{Figure, FigureKind};

/// Names the figure, its AUVs, and its worth.
pub(crate) fn sentence(figure: &Figure) -> String {
    let about = match &figure.vehicles[..] {
        [one] => one.auv.to_string(),
        several => format!("the mean of {} AUVs", several.len()),
    };
    let hand = if figure.rate_radps < 0.0 { "port" } else { "starboard" };
    let side = if figure.starboard_m < 0.0 { "port" } else { "starboard" };
    let (along, across) = (figure.semi_ahead_m, figure.semi_starboard_m);
    let sails = match figure.kind {
        FigureKind::Above => format!("staying above {about}"),
        FigureKind::Circle => format!("circling {about} to {hand} at {along:.0} m"),
        FigureKind::Ellipse => {
            format!("sailing an ellipse of {along:.0} by {across:.0} m about {about} to {hand}")
        }
        FigureKind::ZigzagAstern => {
            let astern = -figure.ahead_m;
            format!("zigzagging {across:.0} m to either side, {astern:.0} m astern of {about}")
        }
        FigureKind::ZigzagAbeam => {
            let abeam = figure.starboard_m.abs();
            format!("zigzagging {along:.0} m forward and back, {abeam:.0} m to {side} of {about}")
        }
    };
    let largest = |sigma: fn(&crate::facts::localise::LocalisedVehicle) -> f64| {
        figure.vehicles.iter().map(sigma).fold(0.0, f64::max)
    };
    let (on_it, above) = (largest(|auv| auv.sigma_m), largest(|auv| auv.sigma_above_m));
    let unknown = figure.vehicles.iter().any(|auv| auv.sigma_now_m.is_none());
    let unknown = if unknown { "; present uncertainty not known" } else { "" };
    match figure.kind {
        FigureKind::Above => format!("{sails}: {on_it:.1} m{unknown}"),
        _ => format!("{sails}: {on_it:.1} m, {above:.1} m if it stayed above{unknown}"),
    }
}
