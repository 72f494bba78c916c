//! Whether two lines are orbital elements: what the satellite checks before it stores them.

use protocol::TwoLines;

/// Whether both lines bear their number, the same catalogue number and a right checksum.
pub(crate) fn are_elements(lines: &TwoLines) -> bool {
    let (first, second) = (lines.line_1().as_bytes(), lines.line_2().as_bytes());
    first.starts_with(b"1 ")
        && second.starts_with(b"2 ")
        && first.get(2..7).is_some_and(|number| Some(number) == second.get(2..7))
        && [first, second].into_iter().all(is_checksum_right)
}

/// The last digit is the sum of all digits before it, a minus counting as 1, modulo 10.
fn is_checksum_right(line: &[u8]) -> bool {
    let Some((last, rest)) = line.split_last() else { return false };
    let sum: u32 = rest
        .iter()
        .map(|byte| match byte {
            b'0'..=b'9' => u32::from(byte - b'0'),
            b'-' => 1,
            _ => 0,
        })
        .sum();
    u32::from(*last) == sum % 10 + u32::from(b'0')
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: &str = "1 25544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2927";
    const SECOND: &str = "2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537";

    fn check(first: &str, second: &str) -> bool {
        are_elements(&TwoLines::new(first, second).unwrap())
    }

    #[test]
    fn a_published_pair_is_accepted_and_every_slip_is_not() {
        assert!(check(FIRST, SECOND));
        assert!(!check(SECOND, FIRST));
        assert!(!check(&FIRST.replace("2927", "2926"), SECOND));
        assert!(!check(FIRST, &SECOND.replace("51.6416", "51.6426")));
        let other = SECOND.replace("25544", "25545").replace("563537", "563538");
        assert!(!check(FIRST, &other), "of another satellite, though its checksum is right");
    }
}
