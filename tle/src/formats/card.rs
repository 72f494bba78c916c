//! The columns of a TLE's two lines. A refused line is refused with its column.

use super::omm::refuse_out_of_range;
use super::{Checksums, SetFault, Warning, catalogue};
use crate::elements::Elements;
use crate::time::{DAY_US, UtcInstant, days_from_civil, days_in_year, decimals_as_parts};

/// Columns without the checksum.
const COLUMNS: usize = 68;
/// Years from here to 99 are of the 20th century (Sputnik), those below of the 21st.
pub(super) const FIRST_YEAR: i64 = 57;

/// The line of the pair (1 or 2) and its fault.
type Refusal = (u8, SetFault);

/// One line of a pair: 68 ASCII columns.
struct Card<'a> {
    tle_line: u8,
    text: &'a str,
}

/// Reads a pair. Its name is for the caller to add.
pub(super) fn read(
    first: &str,
    second: &str,
    checksums: Checksums,
) -> Result<(Elements, Vec<Warning>), Refusal> {
    let mut warnings = Vec::new();
    let one = Card::new(1, first)?;
    let two = Card::new(2, second)?;
    one.blanks(&[2, 9, 18, 33, 44, 53, 62, 64])?;
    two.blanks(&[2, 8, 17, 26, 34, 43, 52])?;
    let norad_cat_id = one.catalogue_number()?;
    let second_id = two.catalogue_number()?;
    if norad_cat_id != second_id {
        return Err((2, SetFault::CatalogueNumbersDiffer { first: norad_cat_id, second: second_id }));
    }
    let ephemeris_type = one.ephemeris_type()?;
    if ephemeris_type == Some(4) {
        return Err((1, SetFault::Theory { found: "SGP4-XP (ephemeris type 4 in column 63)".to_owned() }));
    }
    if let Some(found) = ephemeris_type.filter(|&number| number != 0) {
        warnings.push(Warning::EphemerisType { found });
    }
    let elements = Elements {
        name: None,
        object_id: one.designator(&mut warnings),
        norad_cat_id: Some(norad_cat_id),
        epoch: one.epoch(&mut warnings)?,
        mean_motion_rev_day: two.fixed(53, 63, 55, "mean motion")?,
        eccentricity: two.eccentricity()?,
        inclination_deg: two.fixed(9, 16, 12, "inclination")?,
        raan_deg: two.fixed(18, 25, 21, "right ascension of the node")?,
        arg_of_perigee_deg: two.fixed(35, 42, 38, "argument of perigee")?,
        mean_anomaly_deg: two.fixed(44, 51, 47, "mean anomaly")?,
        bstar: one.with_exponent(54, "B*")?,
        mean_motion_dot: one.fixed(34, 43, 35, "derivative of mean motion")?,
        mean_motion_ddot: one.with_exponent(45, "second derivative of mean motion")?,
        ephemeris_type,
        classification: one.classification()?,
        element_set_no: one.whole(65, 68, "element set number")?,
        rev_at_epoch: two.whole(64, 68, "revolution number")?,
        further: Vec::new(),
    };
    refuse_out_of_range(&elements).map_err(|fault| (2, fault))?;
    one.checksum(first, checksums, &mut warnings)?;
    two.checksum(second, checksums, &mut warnings)?;
    Ok((elements, warnings))
}

impl<'a> Card<'a> {
    fn new(tle_line: u8, line: &'a str) -> Result<Self, Refusal> {
        for (index, character) in line.chars().take(COLUMNS).enumerate() {
            if !(' '..='~').contains(&character) {
                let fault = SetFault::Column {
                    tle_line,
                    column: index + 1,
                    field: "any column",
                    found: character,
                    wanted: "plain ASCII; a tab or a special blank from a web page is none",
                };
                return Err((tle_line, fault));
            }
        }
        match line.get(..COLUMNS) {
            Some(text) => Ok(Self { tle_line, text }),
            None => Err((tle_line, SetFault::CutOff { tle_line, found: line.len() })),
        }
    }

    /// Columns `from` to `to`, counted from 1, both included.
    fn columns(&self, from: usize, to: usize) -> &'a str {
        self.text.get(from - 1..to).unwrap_or_default()
    }

    fn refuse(&self, column: usize, field: &'static str, wanted: &'static str) -> Refusal {
        let found = self.text.as_bytes().get(column - 1).copied().map_or(' ', char::from);
        (self.tle_line, SetFault::Column { tle_line: self.tle_line, column, field, found, wanted })
    }

    /// These columns must be blank: if one is not, the line is shifted from there on.
    fn blanks(&self, columns: &[usize]) -> Result<(), Refusal> {
        match columns.iter().find(|&&column| self.columns(column, column) != " ") {
            Some(&column) => Err(self.refuse(column, "between two fields", "a blank; is the line shifted?")),
            None => Ok(()),
        }
    }

    fn catalogue_number(&self) -> Result<u32, Refusal> {
        catalogue::from_columns(self.columns(3, 7).as_bytes()).map_err(|index| {
            self.refuse(
                3 + index,
                "catalogue number",
                "digits, or a capital letter (no I, no O) and four digits",
            )
        })
    }

    fn classification(&self) -> Result<Option<char>, Refusal> {
        match self.columns(8, 8) {
            " " => Ok(None),
            "U" => Ok(Some('U')),
            "C" => Ok(Some('C')),
            "S" => Ok(Some('S')),
            _ => Err(self.refuse(8, "classification", "U, C or S")),
        }
    }

    /// The designator with its full year; kept as it is when it has not the usual form.
    fn designator(&self, warnings: &mut Vec<Warning>) -> Option<String> {
        let text = self.columns(10, 17).trim();
        if text.is_empty() {
            return None;
        }
        let usual = text.is_char_boundary(5).then(|| text.split_at(5)).filter(|(launch, piece)| {
            launch.bytes().all(|byte| byte.is_ascii_digit())
                && (1..=3).contains(&piece.len())
                && piece.bytes().all(|byte| byte.is_ascii_uppercase())
        });
        let Some((launch, piece)) = usual else {
            warnings.push(Warning::OddDesignator { found: text.to_owned() });
            return Some(text.to_owned());
        };
        let (year, number) = launch.split_at(2);
        let century = if year.parse::<i64>().is_ok_and(|year| year < FIRST_YEAR) { "20" } else { "19" };
        Some(format!("{century}{year}-{number}{piece}"))
    }

    fn epoch(&self, warnings: &mut Vec<Warning>) -> Result<UtcInstant, Refusal> {
        let text = self.columns(19, 32);
        let padded = text.trim_end();
        if padded.contains(' ') {
            warnings.push(Warning::BlankInEpoch { found: padded.to_owned() });
        }
        let year = self.padded(19, 20, "epoch year")?;
        let day = self.padded(21, 23, "epoch day")?;
        if self.columns(24, 24) != "." {
            return Err(self.refuse(24, "epoch day", "the decimal point"));
        }
        let decimals = self.columns(25, 32).trim_end();
        if let Some(bad) = decimals.bytes().position(|byte| !byte.is_ascii_digit()) {
            return Err(self.refuse(25 + bad, "epoch day", "a digit"));
        }
        let year = if year < FIRST_YEAR { 2000 + year } else { 1900 + year };
        if !(1..=days_in_year(year)).contains(&day) {
            let fault = SetFault::Value {
                field: "the epoch's day of the year".to_owned(),
                found: format!("{}{day}.{decimals}", if day < 100 { "0" } else { "" }),
                wanted: "1 to 365, or 366 in a leap year",
            };
            return Err((1, fault));
        }
        // The columns hold at most eight digits: 864 us each, exact.
        let fraction_us = decimals_as_parts(decimals, DAY_US).unwrap_or(0);
        Ok(UtcInstant::from_unix_us((days_from_civil(year, 1, 1) + day - 1) * DAY_US + fraction_us))
    }

    /// Digits padded with zeros or blanks on the left.
    fn padded(&self, from: usize, to: usize, field: &'static str) -> Result<i64, Refusal> {
        let text = self.columns(from, to);
        let digits = text.trim_start();
        if digits.is_empty() {
            return Err(self.refuse(to, field, "a digit"));
        }
        if let Some(bad) = digits.bytes().position(|byte| !byte.is_ascii_digit()) {
            return Err(self.refuse(from + text.len() - digits.len() + bad, field, "a digit"));
        }
        digits.parse().map_err(|_| self.refuse(from, field, "digits"))
    }

    /// Digits padded on the left, or nothing.
    fn whole(&self, from: usize, to: usize, field: &'static str) -> Result<Option<u32>, Refusal> {
        if self.columns(from, to).trim().is_empty() {
            return Ok(None);
        }
        let number = self.padded(from, to, field)?;
        Ok(u32::try_from(number).ok())
    }

    fn ephemeris_type(&self) -> Result<Option<u8>, Refusal> {
        match self.columns(63, 63).as_bytes() {
            b" " => Ok(None),
            [digit @ b'0'..=b'9'] => Ok(Some(digit - b'0')),
            _ => Err(self.refuse(63, "ephemeris type", "a digit or a blank")),
        }
    }

    /// A number whose decimal point stands in its column: elsewhere the field is shifted.
    fn fixed(&self, from: usize, to: usize, point: usize, field: &'static str) -> Result<f64, Refusal> {
        let text = self.columns(from, to);
        let before = self.columns(from, point - 1).trim_start();
        let unsigned = before.strip_prefix(['+', '-']).unwrap_or(before);
        if let Some(bad) = unsigned.bytes().position(|byte| !byte.is_ascii_digit()) {
            return Err(self.refuse(point - unsigned.len() + bad, field, "a digit"));
        }
        if self.columns(point, point) != "." {
            return Err(self.refuse(point, field, "the decimal point; is the field shifted?"));
        }
        let after = self.columns(point + 1, to).trim_end();
        if after.is_empty() {
            return Err(self.refuse(point + 1, field, "a digit"));
        }
        if let Some(bad) = after.bytes().position(|byte| !byte.is_ascii_digit()) {
            return Err(self.refuse(point + 1 + bad, field, "a digit"));
        }
        // -0 becomes 0.
        text.trim()
            .parse::<f64>()
            .map(|number| number + 0.0)
            .map_err(|_| self.refuse(from, field, "a number"))
    }

    fn eccentricity(&self) -> Result<f64, Refusal> {
        let (text, field) = (self.columns(27, 33), "eccentricity");
        if let Some(bad) = text.bytes().position(|byte| !byte.is_ascii_digit()) {
            return Err(self.refuse(27 + bad, field, "a digit"));
        }
        format!("0.{text}").parse().map_err(|_| self.refuse(27, field, "digits"))
    }

    /// Eight columns: sign, five digits after an implied point, sign and digit of a power of ten.
    fn with_exponent(&self, from: usize, field: &'static str) -> Result<f64, Refusal> {
        let sign = match self.columns(from, from) {
            " " | "+" | "0" => "",
            "-" => "-",
            _ => return Err(self.refuse(from, field, "a sign or a blank")),
        };
        let digits = self.columns(from + 1, from + 5);
        if let Some(bad) = digits.bytes().position(|byte| !byte.is_ascii_digit()) {
            return Err(self.refuse(from + 1 + bad, field, "a digit"));
        }
        let exponent_sign = match self.columns(from + 6, from + 6) {
            "+" => "",
            "-" => "-",
            _ => return Err(self.refuse(from + 6, field, "the sign of the power of ten")),
        };
        let exponent = self.columns(from + 7, from + 7);
        if !exponent.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(self.refuse(from + 7, field, "the digit of the power of ten"));
        }
        format!("{sign}0.{digits}e{exponent_sign}{exponent}")
            .parse::<f64>()
            .map(|number| number + 0.0)
            .map_err(|_| self.refuse(from, field, "a number"))
    }

    fn checksum(&self, line: &str, checksums: Checksums, warnings: &mut Vec<Warning>) -> Result<(), Refusal> {
        let tle_line = self.tle_line;
        let found = match line.as_bytes().get(COLUMNS) {
            None | Some(b' ' | b'\t') => {
                warnings.push(Warning::NoChecksum { tle_line });
                return Ok(());
            }
            Some(digit @ b'0'..=b'9') => digit - b'0',
            Some(_) => {
                let found = line.chars().nth(COLUMNS).unwrap_or(' ');
                let wanted = "the checksum's digit";
                return Err((
                    tle_line,
                    SetFault::Column { tle_line, column: 69, field: "checksum", found, wanted },
                ));
            }
        };
        let expected = checksum(self.text);
        if found == expected {
            return Ok(());
        }
        match checksums {
            Checksums::Strict => Err((tle_line, SetFault::Checksum { tle_line, found, expected })),
            Checksums::Lenient => {
                warnings.push(Warning::Checksum { tle_line, found, expected });
                Ok(())
            }
        }
    }
}

/// The digit for column 69: digits count their value, minus signs 1, everything else nothing; modulo 10.
pub(super) fn checksum(columns: &str) -> u8 {
    let sum = columns.bytes().take(COLUMNS).fold(0_u32, |sum, byte| match byte {
        b'0'..=b'9' => sum + u32::from(byte - b'0'),
        b'-' => sum + 1,
        _ => sum,
    });
    u8::try_from(sum % 10).unwrap_or(0)
}
