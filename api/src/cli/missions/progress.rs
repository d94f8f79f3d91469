//! The progress bar of a long command.

use indicatif::{ProgressBar, ProgressStyle};

/// On standard error, and only where that is a terminal.
pub(super) fn bar() -> ProgressBar {
    const TICKS: u64 = 1000;
    let style = ProgressStyle::with_template("{msg:34} {wide_bar} {percent:>3} % {eta:>4}")
        .expect("the template is a constant");
    ProgressBar::new(TICKS).with_style(style)
}

pub(super) fn show(bar: &ProgressBar, stage: &str, done: f64) {
    if bar.message() != stage {
        bar.set_message(stage.to_owned());
        bar.reset();
    }
    let ticks = bar.length().unwrap_or_default();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a fraction of a thousand ticks, and the cast saturates"
    )]
    bar.set_position((done * ticks as f64) as u64);
}
