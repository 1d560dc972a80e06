//! How long a stage still takes, from how fast it has been lately.

use std::collections::VecDeque;
use std::time::Duration;

/// No estimate before a stage has run so long,
const LEAST_TIME: Duration = Duration::from_secs(2);
/// and has done this share of its steps since it was first heard of.
const LEAST_SHARE: f64 = 0.05;
/// Stages of fewer steps have none: their steps are of different kinds.
const FEWEST_STEPS: usize = 10;
/// Steps are remembered at most so often.
const SPACING: Duration = Duration::from_millis(250);

/// What a stage has told so far.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// Times since the stage began and steps done, the oldest first: the first of all, then those of the later half of the time.
    told: VecDeque<(Duration, usize)>,
    first: usize,
}

impl Pace {
    /// At the time `now` of a stage `done` of `total` steps are done; how many seconds are left, once that can be said.
    pub(super) fn seconds_left(&mut self, now: Duration, done: usize, total: usize) -> Option<f64> {
        let &(last, _) = self.told.back().unwrap_or_else(|| {
            self.first = done;
            &(Duration::ZERO, 0)
        });
        if self.told.is_empty() || now.saturating_sub(last) >= SPACING {
            self.told.push_back((now, done));
        }
        // One from before the later half stays, from which it is counted.
        while self.told.get(1).is_some_and(|(time, _)| 2 * *time <= now) {
            self.told.pop_front();
        }
        let &(since, before) = self.told.front()?;
        let (steps, seconds) = (done.saturating_sub(before), now.saturating_sub(since).as_secs_f64());
        let share = done.saturating_sub(self.first) as f64 / total.max(1) as f64;
        let is_known = total >= FEWEST_STEPS && now >= LEAST_TIME && share >= LEAST_SHARE && steps > 0 && seconds > 0.0;
        is_known.then(|| seconds / steps as f64 * total.saturating_sub(done) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    #[test]
    fn nothing_is_said_before_it_means_something() {
        let mut pace = Pace::default();
        assert_eq!(pace.seconds_left(at(0.0), 0, 100), None);
        assert_eq!(pace.seconds_left(at(1.0), 50, 100), None, "too early");
        let mut pace = Pace::default();
        assert_eq!(pace.seconds_left(at(0.0), 0, 100), None);
        assert_eq!(pace.seconds_left(at(9.0), 4, 100), None, "too little");
        assert_eq!(pace.seconds_left(at(10.0), 5, 100), Some(190.0));
        assert_eq!(Pace::default().seconds_left(at(5.0), 7, 20), None, "a single time has no pace");
    }

    #[test]
    fn the_recent_pace_counts() {
        let mut pace = Pace::default();
        // A slow start, then ten steps a second.
        let mut left = None;
        for tenth in 0..=200 {
            let done = if tenth < 100 { tenth / 50 } else { tenth - 100 };
            left = pace.seconds_left(at(f64::from(tenth) / 10.0), done as usize, 200);
        }
        assert!(left.is_some_and(|left| (9.0..=11.0).contains(&left)), "{left:?}");
        assert!(pace.told.len() < 60, "{}", pace.told.len());
    }
}
