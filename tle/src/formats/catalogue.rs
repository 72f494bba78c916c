//! Catalogue numbers in the five columns of a TLE: digits, or Alpha-5.

/// The greatest number that Alpha-5 can hold: `Z9999`.
pub const ALPHA5_MAX: u32 = 339_999;
/// The greatest catalogue number: nine digits.
pub const CATALOGUE_MAX: u32 = 999_999_999;

/// The letters that stand for 10 to 33; I and O are not used.
const LETTERS: &[u8; 24] = b"ABCDEFGHJKLMNPQRSTUVWXYZ";

/// Reads five columns: digits, padded with blanks or zeros on the left, or a capital letter and four digits.
///
/// # Errors
/// The index (from 0) of the first character that cannot stand where it does.
pub(super) fn from_columns(columns: &[u8]) -> Result<u32, usize> {
    let start = columns.iter().position(|&byte| byte != b' ').ok_or(0_usize)?;
    let mut value = 0;
    for (index, &byte) in columns.iter().enumerate().skip(start) {
        let digit = match byte {
            b'0'..=b'9' => u32::from(byte - b'0'),
            _ if index == 0 => {
                let letter = LETTERS.iter().position(|&letter| letter == byte).ok_or(0_usize)?;
                10 + u32::try_from(letter).map_err(|_| 0_usize)?
            }
            _ => return Err(index),
        };
        value = value * 10 + digit;
    }
    Ok(value)
}

/// Five columns for a number; `None` above [`ALPHA5_MAX`].
pub(super) fn to_columns(number: u32) -> Option<String> {
    match number {
        0..=99_999 => Some(format!("{number:05}")),
        100_000..=ALPHA5_MAX => {
            let letter = LETTERS.get((number / 10_000 - 10) as usize)?;
            Some(format!("{}{:04}", char::from(*letter), number % 10_000))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha5_is_read_and_written() {
        for (columns, number) in [
            ("A0000", 100_000),
            ("E8493", 148_493),
            ("H9999", 179_999),
            ("J2931", 182_931),
            ("P4018", 234_018),
            ("W1928", 301_928),
            ("Z9999", 339_999),
            ("00005", 5),
            ("99999", 99_999),
        ] {
            assert_eq!(from_columns(columns.as_bytes()), Ok(number), "{columns}");
            assert_eq!(to_columns(number).as_deref(), Some(columns));
        }
        assert_eq!(from_columns(b"  511"), Ok(511));
        assert_eq!(to_columns(340_000), None);
    }

    #[test]
    fn characters_outside_the_scheme_are_refused_by_place() {
        assert_eq!(from_columns(b"     "), Err(0));
        assert_eq!(from_columns(b"I0000"), Err(0));
        assert_eq!(from_columns(b"O0000"), Err(0));
        assert_eq!(from_columns(b"a0000"), Err(0));
        assert_eq!(from_columns(b"1 234"), Err(1));
        assert_eq!(from_columns(b"123A5"), Err(3));
        assert_eq!(from_columns(b" A234"), Err(1));
    }
}
