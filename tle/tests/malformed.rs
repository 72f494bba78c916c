//! Defects seen in the wild, one test each: what is accepted, what is refused, where, and what it says.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use tle::formats::{self, Checksums, Found, SetError, SourceError, Warning};

const NAME: &str = "ISS (ZARYA)";
const ONE: &str = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992";
const TWO: &str = "2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008";

fn read(text: &str) -> Vec<Result<Found, SetError>> {
    formats::sets(text, Checksums::Strict).unwrap().collect()
}

fn read_leniently(text: &str) -> Vec<Result<Found, SetError>> {
    formats::sets(text, Checksums::Lenient).unwrap().collect()
}

fn sound() -> tle::Elements {
    read(&format!("{NAME}\n{ONE}\n{TWO}\n")).remove(0).unwrap().elements
}

/// The only set of a text.
fn only(text: &str) -> Result<Found, SetError> {
    let mut sets = read(text);
    assert_eq!(sets.len(), 1, "{sets:?}");
    sets.remove(0)
}

fn refusal(one: &str, two: &str) -> String {
    only(&format!("{NAME}\n{one}\n{two}\n")).unwrap_err().to_string()
}

/// A line with other columns from `column` on, and the right checksum.
fn with(line: &str, column: usize, text: &str) -> String {
    let mut changed = line[..68].to_owned();
    changed.replace_range(column - 1..column - 1 + text.len(), text);
    let sum: u32 = changed.chars().map(|c| if c == '-' { 1 } else { c.to_digit(10).unwrap_or(0) }).sum();
    format!("{changed}{}", sum % 10)
}

#[test]
fn sound_set_is_read_to_its_last_field() {
    let set = sound();
    assert_eq!(set.name.as_deref(), Some(NAME));
    assert_eq!(set.object_id.as_deref(), Some("1998-067A"));
    assert_eq!(set.norad_cat_id, Some(25_544));
    assert_eq!(set.epoch.to_string(), "2020-07-12T21:16:01.000416Z");
    assert_eq!(set.mean_motion_dot, -0.000_022_18);
    assert_eq!(set.mean_motion_ddot, 0.0);
    assert_eq!(set.bstar, -0.31515e-4);
    assert_eq!((set.ephemeris_type, set.classification), (Some(0), Some('U')));
    assert_eq!((set.element_set_no, set.rev_at_epoch), (Some(999), Some(23_600)));
    assert_eq!(
        (set.inclination_deg, set.raan_deg, set.eccentricity, set.arg_of_perigee_deg, set.mean_anomaly_deg),
        (51.6461, 221.2784, 0.0001413, 89.1723, 280.4612)
    );
    assert_eq!(set.mean_motion_rev_day, 15.49507896);
}

#[test]
fn line_ends_blanks_byte_order_marks_and_comments_are_accepted() {
    let text =
        format!("\u{feff}# of today\r\n\r\n{NAME}  \t\r\n\r\n{ONE}  \r\n# between\r\n{TWO}\t \r\n\r\n");
    assert_eq!(only(&text).unwrap().elements, sound());
    assert_eq!(only(&format!("0 {NAME}\n{ONE}\n{TWO}")).unwrap().elements, sound());
    let bytes = formats::text_of(text.as_bytes()).unwrap();
    assert_eq!(only(&bytes).unwrap().line, 3);
}

#[test]
fn text_after_column_69_is_ignored() {
    let text = format!("{NAME}\n{ONE} und\u{e9}\n{TWO}     0.00      4320.0        360.00\n");
    assert_eq!(only(&text).unwrap().elements, sound());
}

#[test]
fn catalogue_number_may_be_padded_with_blanks() {
    let set = only(&format!("{}\n{}", with(ONE, 3, "  511"), with(TWO, 3, "  511"))).unwrap();
    assert_eq!(set.elements.norad_cat_id, Some(511));
    assert_eq!(set.elements.name, None);
}

#[test]
fn designator_ephemeris_type_and_numbers_may_be_blank() {
    let one = with(&with(&with(ONE, 10, "        "), 63, " "), 65, "    ");
    let set = only(&format!("{one}\n{}", with(TWO, 64, "     "))).unwrap().elements;
    assert_eq!((set.object_id, set.ephemeris_type), (None, None));
    assert_eq!((set.element_set_no, set.rev_at_epoch), (None, None));
}

#[test]
fn leading_zeros_and_plus_signs_are_accepted() {
    let one = with(&with(&with(ONE, 34, "+.00002218"), 45, "+10762-4"), 54, " 00000+0");
    let two = with(&with(TWO, 9, "028.3286"), 35, "+09.1723");
    let set = only(&format!("{one}\n{two}")).unwrap().elements;
    assert_eq!((set.mean_motion_dot, set.mean_motion_ddot, set.bstar), (0.000_022_18, 0.10762e-4, 0.0));
    assert_eq!((set.inclination_deg, set.arg_of_perigee_deg), (28.3286, 9.1723));
}

#[test]
fn missing_checksum_is_accepted_with_a_warning() {
    let found = only(&format!("{}\n{}", &ONE[..68], &TWO[..68])).unwrap();
    assert_eq!(found.warnings, [Warning::NoChecksum { tle_line: 1 }, Warning::NoChecksum { tle_line: 2 }]);
}

#[test]
fn epoch_padded_with_blanks_is_accepted_with_a_warning() {
    let found = only(&format!("{}\n{TWO}", with(ONE, 19, "98  1.123     "))).unwrap();
    assert_eq!(found.elements.epoch.to_string(), "1998-01-01T02:57:07.200000Z");
    assert_eq!(found.warnings, [Warning::BlankInEpoch { found: "98  1.123".to_owned() }]);
}

#[test]
fn wrong_checksum_is_refused_or_told_with_line_and_both_digits() {
    let text = format!("{NAME}\n{ONE}\n{}7\n", &TWO[..68]);
    let error = only(&text).unwrap_err().to_string();
    assert_eq!(
        error,
        "line 3 (ISS (ZARYA)): the checksum of TLE line 2 is 7, but the line adds up to 8: it was changed on its way. \
         Fetch it again, or read it leniently"
    );
    let found = read_leniently(&text).remove(0).unwrap();
    assert_eq!(found.warnings, [Warning::Checksum { tle_line: 2, found: 7, expected: 8 }]);
    assert_eq!(found.elements, sound());
}

#[test]
fn lines_of_different_objects_and_lonely_lines_cost_only_their_own_set() {
    let other = with(TWO, 3, "25545");
    let text = format!(
        "A\n{ONE}\n{other}\nB\n{ONE}\nC\n{ONE}\n{ONE}\n{TWO}\nD\n{TWO}\nE\n{NAME}\n{ONE}\n{TWO}\n{ONE}\n"
    );
    let sets = read(&text);
    let told: Vec<String> = sets
        .iter()
        .map(|set| match set {
            Ok(found) => format!("{} at line {}", found.elements.label(), found.line),
            Err(error) => error.to_string(),
        })
        .collect();
    assert_eq!(
        told,
        [
            "line 3 (A): line 1 is of object 25544 and line 2 of object 25545: they do not belong together",
            "line 5 (B): TLE line 2 is missing after line 1",
            "line 7 (C): TLE line 2 is missing after line 1",
            "object 25544 at line 8",
            "line 11 (D): TLE line 1 is missing before line 2",
            "line 12: no elements follow 'E'",
            "ISS (ZARYA) at line 13",
            "line 16 (object 25544): TLE line 2 is missing after line 1",
        ]
    );
}

#[test]
fn shifted_columns_special_blanks_and_small_exponents_are_refused_by_column() {
    let shifted = format!("{} {}", &TWO[..40], &TWO[40..]);
    assert!(
        refusal(ONE, &shifted).contains("TLE line 2, column 43 (between two fields): found '3'"),
        "{shifted}"
    );
    let lost = TWO.replacen("  51.6461", " 51.6461", 1);
    assert!(
        refusal(ONE, &lost).contains("TLE line 2, column 17 (between two fields): found '2'"),
        "{}",
        refusal(ONE, &lost)
    );
    let leading = format!(" {ONE}");
    assert!(refusal(&leading, TWO).contains("TLE line 1, column 2 "), "{}", refusal(&leading, TWO));
    let special = TWO.replacen("  51", "\u{a0} 51", 1);
    assert!(refusal(ONE, &special).contains("TLE line 2, column 8 (any column): found '\\u{a0}'"));
    let tab = ONE.replacen("A   20", "A\t20", 1);
    assert!(refusal(&tab, TWO).contains("TLE line 1, column 16 (any column): found '\\t'"));
    let exponent = with(ONE, 54, "-3151e-4");
    assert!(
        refusal(&exponent, TWO).contains("column 59 (B*): found 'e', wanted a digit"),
        "{}",
        refusal(&exponent, TWO)
    );
    let lower = with(ONE, 3, "a5544");
    assert!(refusal(&lower, TWO).contains("column 3 (catalogue number): found 'a'"));
    assert!(refusal(&ONE[..60], TWO).contains("TLE line 1 has 60 columns instead of 69: it was cut off"));
}

#[test]
fn impossible_numbers_are_refused() {
    let tall = with(TWO, 9, "180.1000");
    assert!(refusal(ONE, &tall).contains("INCLINATION is '180.1', wanted 0 to 180 degrees"));
    let still = with(TWO, 53, " 0.00000000");
    assert!(refusal(ONE, &still).contains("MEAN_MOTION is '0', wanted more than 0 rev/day"));
    for epoch in ["20000.50000000", "20367.00000000", "21366.00000000"] {
        let early = with(ONE, 19, epoch);
        assert!(refusal(&early, TWO).contains("wanted 1 to 365, or 366 in a leap year"), "{epoch}");
    }
    assert!(only(&format!("{}\n{TWO}", with(ONE, 19, "20366.99999999"))).is_ok());
}

#[test]
fn years_turn_at_57() {
    let epoch = |text| only(&format!("{}\n{TWO}", with(ONE, 19, text))).unwrap().elements.epoch.to_string();
    assert_eq!(epoch("57001.00000000"), "1957-01-01T00:00:00.000000Z");
    assert_eq!(epoch("56366.00000000"), "2056-12-31T00:00:00.000000Z");
}

#[test]
fn sgp4_xp_elements_are_refused_in_every_form() {
    let wanted = "not for SGP4: propagating them with SGP4 would be wrong by kilometres";
    assert!(refusal(&with(ONE, 63, "4"), TWO).contains(wanted));
    let mut elements = sound();
    elements.ephemeris_type = Some(4);
    for form in formats::Form::ALL {
        let text = formats::write(form, &[elements.clone()]).unwrap();
        let error = only(&text).unwrap_err().to_string();
        assert!(error.contains(wanted) && error.contains("EPHEMERIS_TYPE 0"), "{error}");
    }
}

#[test]
fn name_that_looks_like_an_element_line_is_a_name() {
    for name in ["1 SATELLITE", "2 25544U IS A NAME", "1 25544U 98067A   20194.8"] {
        let found = only(&format!("{name}\n{ONE}\n{TWO}")).unwrap();
        assert_eq!(found.elements.name.as_deref(), Some(name));
    }
}

#[test]
fn alpha_5_and_nine_digits_are_read_and_only_what_fits_is_written_as_tle() {
    let found = only(&format!("{}\n{}", with(ONE, 3, "E8493"), with(TWO, 3, "E8493"))).unwrap();
    assert_eq!(found.elements.norad_cat_id, Some(148_493));
    let mut elements = sound();
    for id in [339_999, 340_000, 999_999_999] {
        elements.norad_cat_id = Some(id);
        for form in formats::Form::ALL {
            let is_omm = form.name().starts_with("OMM");
            match formats::write(form, &[elements.clone()]) {
                Ok(text) => {
                    assert!(is_omm || id == 339_999);
                    assert_eq!(only(&text).unwrap().elements.norad_cat_id, Some(id), "{}", form.name());
                }
                Err(error) => {
                    assert!(!is_omm && id > 339_999);
                    assert!(error.to_string().contains("write an OMM"), "{error}");
                }
            }
        }
    }
    let json = formats::write(formats::Form::OmmJson, &[elements]).unwrap();
    let ten = json.replace("999999999", "1999999999");
    assert!(
        only(&ten)
            .unwrap_err()
            .to_string()
            .contains("NORAD_CAT_ID is '1999999999', wanted up to nine digits")
    );
}

#[test]
fn answers_that_are_no_elements_are_failures_of_the_download() {
    let source = |text: &str| formats::sets(text, Checksums::Strict).unwrap_err();
    assert_eq!(source(""), SourceError::Empty);
    assert_eq!(source(" \r\n# nothing\n"), SourceError::Empty);
    let page = "<!DOCTYPE html>\n<html><head><TITLE>403 Forbidden</TITLE></head></html>";
    assert_eq!(source(page), SourceError::Html { title: Some("403 Forbidden".to_owned()) });
    assert!(source(page).to_string().contains("Keep the elements you have"));
    assert!(matches!(source("No GP data found"), SourceError::NoData { .. }));
    assert!(matches!(source("[]"), SourceError::NoData { .. }));
    assert!(matches!(source("{\"error\":\"You must be logged in\"}"), SourceError::Message { .. }));
    let same = "GP data has not updated since your last successful download of GROUP=active at 05:00. Data is updated ...";
    assert!(matches!(source(same), SourceError::NotUpdated { .. }));
    assert!(matches!(source("The quick brown fox"), SourceError::NotElements { .. }));
    assert_eq!(formats::text_of(&[0xff, 0xfe, b'1', 0]), Err(SourceError::Utf16));
    assert_eq!(formats::text_of(b"\x1f\x8b\0\0"), Err(SourceError::Binary));
}

#[test]
fn verification_file_with_its_oddities_is_read() {
    // Comments, numbers after column 69, a line with its last digits out of place, and three wrong checksums.
    let text: String = include_str!("../vectors/sgp4.txt")
        .lines()
        .filter_map(|line| match line.split_once(": ") {
            Some(("line1" | "line2", card)) => Some(format!("{card}\n")),
            _ => line.starts_with('#').then(|| format!("{line}\n")),
        })
        .collect();
    let strict = read(&text);
    let refused: Vec<String> =
        strict.iter().filter_map(|set| set.as_ref().err()).map(ToString::to_string).collect();
    assert_eq!((strict.len(), refused.len()), (33, 3), "{refused:?}");
    assert!(refused.iter().all(|error| error.contains("the checksum of TLE line 1")), "{refused:?}");
    assert!(read_leniently(&text).iter().all(Result::is_ok));
}
