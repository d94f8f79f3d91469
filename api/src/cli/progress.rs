//! Progress of long commands, on standard error and only if that is a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// A bar that [`show`] moves.
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
        reason = "a fraction of a thousand ticks, and the cast saturates"
    )]
    bar.set_position((done * ticks as f64) as u64);
}

/// Shows `message` while `work` runs.
pub(super) fn with_spinner<T>(message: &'static str, work: impl FnOnce() -> T) -> T {
    let spinner = ProgressBar::new_spinner().with_message(message);
    spinner.enable_steady_tick(Duration::from_millis(100));
    let done = work();
    spinner.finish_and_clear();
    done
}
