//! Which stretch of time the plots of one screen show, and where their common cursor stands.

use jiff::{SignedDuration, Timestamp};

const SHORTEST_US: i64 = 1_000;
const LONGEST_US: i64 = 50 * 366 * 86_400 * 1_000_000;

/// The stretch of time that plots show. Its owner hands the same one to each plot that shall move with the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    from: Timestamp,
    to: Timestamp,
    is_following: bool,
    cursor: Option<Timestamp>,
    /// Frame of the interface at which the cursor was set: another plot than the one under the pointer keeps it.
    pub(super) cursor_frame: u64,
}

impl View {
    /// From a moment to another; the ends may come in any order.
    #[must_use]
    pub fn new(from: Timestamp, to: Timestamp) -> Self {
        let mut view = Self { from, to, is_following: false, cursor: None, cursor_frame: 0 };
        view.set(from.min(to), from.max(to));
        view
    }

    /// The stretch of this length that ends now, and goes on doing so.
    #[must_use]
    pub fn following(length: SignedDuration, now: Timestamp) -> Self {
        let from = now.checked_sub(length.abs()).unwrap_or(Timestamp::MIN);
        Self { is_following: true, ..Self::new(from, now) }
    }

    /// Where it begins.
    #[must_use]
    pub fn from(&self) -> Timestamp {
        self.from
    }

    /// Where it ends.
    #[must_use]
    pub fn to(&self) -> Timestamp {
        self.to
    }

    /// How much it shows.
    #[must_use]
    pub fn length(&self) -> SignedDuration {
        self.to.duration_since(self.from)
    }

    /// Whether it ends now, whenever that is.
    #[must_use]
    pub fn is_following(&self) -> bool {
        self.is_following
    }

    /// The moment under the pointer in any of the plots.
    #[must_use]
    pub fn cursor(&self) -> Option<Timestamp> {
        self.cursor
    }

    /// Puts the cursor somewhere, for instance where a frame was chosen in a list.
    pub fn set_cursor(&mut self, cursor: Option<Timestamp>) {
        self.cursor = cursor;
    }

    /// Shows this stretch and stays there.
    pub fn set(&mut self, from: Timestamp, to: Timestamp) {
        self.is_following = false;
        let length_us = (to.as_microsecond() - from.as_microsecond()).clamp(SHORTEST_US, LONGEST_US);
        (self.from, self.to) = (from, at(from.as_microsecond() + length_us));
    }

    /// Ends now from here on; `false` stays where it is.
    pub fn follow(&mut self, follow: bool) {
        self.is_following = follow;
    }

    /// Moves on to `now` when it follows. Each plot does so before it is drawn.
    pub fn advance(&mut self, now: Timestamp) {
        if self.is_following && now != self.to {
            let length_us = self.length_us();
            (self.from, self.to) = (at(now.as_microsecond() - length_us), now);
        }
    }

    /// Moves by this part of its length, towards later times when positive, and follows no longer.
    pub fn pan(&mut self, part: f64) {
        let by_us = (part * self.length_us() as f64) as i64;
        self.set(at(self.from.as_microsecond() + by_us), at(self.to.as_microsecond() + by_us));
    }

    /// Shows `factor` times as much, and leaves `centre` where it is; when it follows, the end stays.
    pub fn zoom(&mut self, factor: f64, centre: Timestamp) {
        let is_following = self.is_following;
        let length_us = self.length_us();
        let wanted_us =
            ((length_us as f64 * factor.clamp(0.01, 100.0)) as i64).clamp(SHORTEST_US, LONGEST_US);
        let centre_us = if is_following { self.to.as_microsecond() } else { centre.as_microsecond() };
        let part = (centre_us - self.from.as_microsecond()) as f64 / length_us.max(1) as f64;
        let from_us = centre_us - (part * wanted_us as f64) as i64;
        self.set(at(from_us), at(from_us + wanted_us));
        self.is_following = is_following;
    }

    pub(super) fn length_us(&self) -> i64 {
        self.to.as_microsecond() - self.from.as_microsecond()
    }
}

/// As near as time reaches.
fn at(us: i64) -> Timestamp {
    Timestamp::from_microsecond(us).unwrap_or(if us < 0 { Timestamp::MIN } else { Timestamp::MAX })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(from_s: i64, to_s: i64) -> View {
        View::new(Timestamp::from_second(from_s).unwrap(), Timestamp::from_second(to_s).unwrap())
    }

    #[test]
    fn zoom_leaves_what_is_under_the_pointer_where_it_is() {
        let mut view = view(1_000, 2_000);
        let centre = Timestamp::from_second(1_250).unwrap();
        view.zoom(0.5, centre);
        assert_eq!((view.from().as_second(), view.to().as_second()), (1_125, 1_625));
        view.zoom(2.0, centre);
        assert_eq!((view.from().as_second(), view.to().as_second()), (1_000, 2_000));
    }

    #[test]
    fn a_view_that_follows_goes_with_the_clock_until_it_is_moved() {
        let now = Timestamp::from_second(10_000).unwrap();
        let mut view = View::following(SignedDuration::from_secs(600), now);
        let later = now + SignedDuration::from_secs(5);
        view.advance(later);
        assert_eq!((view.to(), view.length()), (later, SignedDuration::from_secs(600)));
        view.zoom(0.5, now);
        assert!(view.is_following());
        assert_eq!((view.to(), view.length()), (later, SignedDuration::from_secs(300)));
        view.pan(-0.5);
        view.advance(later + SignedDuration::from_secs(5));
        assert_eq!(view.to(), later - SignedDuration::from_secs(150));
    }

    #[test]
    fn neither_the_ends_of_time_nor_zooming_for_ever_panic() {
        let mut view = View::new(Timestamp::MIN, Timestamp::MAX);
        for _ in 0..50 {
            view.zoom(100.0, Timestamp::MAX);
            view.pan(-10.0);
        }
        for _ in 0..50 {
            view.zoom(0.01, Timestamp::MIN);
            view.pan(10.0);
        }
        assert!(view.from() < view.to());
    }
}
