//! When a message that did not go through is tried again.

use crate::clock::UtcUs;

/// A message that has not gone through for so long is given up, microseconds.
pub const GIVE_UP_US: i64 = 24 * 3_600_000_000;
/// The first pause.
const FIRST_US: i64 = 10_000_000;
/// The longest pause.
const LONGEST_US: i64 = 1_800_000_000;

/// The next attempt after `attempts` that failed, the last one just now; `None`: given up, 24 h after it was made.
///
/// 10 s, 20 s, 40 s … up to half an hour. The last attempt is made when the day is nearly over, not before.
#[must_use]
pub fn retry_at(made_at: UtcUs, attempts: u32, now: UtcUs) -> Option<UtcUs> {
    let doubled = attempts.saturating_sub(1).min(20);
    let pause = FIRST_US.saturating_mul(1 << doubled).min(LONGEST_US);
    let end = made_at.plus(GIVE_UP_US);
    (now < end).then(|| now.plus(pause).min(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_and_a_day_ends_them() {
        let made = UtcUs(1_000_000_000);
        let (mut now, mut attempts, mut pauses) = (made, 0, Vec::new());
        while let Some(next) = retry_at(made, attempts + 1, now) {
            attempts += 1;
            assert!(next > now && next <= made.plus(GIVE_UP_US));
            pauses.push(next.0 - now.0);
            now = next;
        }
        assert_eq!(&pauses[..4], [10_000_000, 20_000_000, 40_000_000, 80_000_000]);
        assert_eq!(now, made.plus(GIVE_UP_US), "the last attempt is at the end of the day");
        assert!((50..70).contains(&attempts), "{attempts}");
        assert_eq!(retry_at(made, u32::MAX, made.plus(5)), Some(made.plus(5 + LONGEST_US)));
    }
}
