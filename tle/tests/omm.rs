//! OMM as the sources write it.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use tle::formats::{self, Checksums, Form, Found, SetError};
use tle::{Elements, Propagator};

const KVN: &str = "\
CCSDS_OMM_VERS = 2.0
COMMENT from a friend
CREATION_DATE  =
ORIGINATOR     =
OBJECT_NAME         = ISS (ZARYA)
OBJECT_ID           = 1998-067A
CENTER_NAME         = EARTH
REF_FRAME           = TEME
TIME_SYSTEM         = UTC
MEAN_ELEMENT_THEORY = SGP4
EPOCH               = 2020-07-12T21:16:01.000416
MEAN_MOTION         = 15.49507896 [rev/day]
ECCENTRICITY        = .0001413
INCLINATION         = 51.6461 [deg]
RA_OF_ASC_NODE      = 221.2784
ARG_OF_PERICENTER   = 89.1723
MEAN_ANOMALY        = 280.4612
EPHEMERIS_TYPE      = 0
CLASSIFICATION_TYPE = U
NORAD_CAT_ID        = 25544
ELEMENT_SET_NO      = 999
REV_AT_EPOCH        = 23600
BSTAR               = -.31515E-4
MEAN_MOTION_DOT     = -.2218E-4
MEAN_MOTION_DDOT    = 0
";

const CELESTRAK_JSON: &str = r#"[{"OBJECT_NAME":"ISS (ZARYA)","OBJECT_ID":"1998-067A","EPOCH":"2020-07-12T21:16:01.000416","MEAN_MOTION":15.49507896,"ECCENTRICITY":0.0001413,"INCLINATION":51.6461,"RA_OF_ASC_NODE":221.2784,"ARG_OF_PERICENTER":89.1723,"MEAN_ANOMALY":280.4612,"EPHEMERIS_TYPE":0,"CLASSIFICATION_TYPE":"U","NORAD_CAT_ID":25544,"ELEMENT_SET_NO":999,"REV_AT_EPOCH":23600,"BSTAR":-3.1515e-5,"MEAN_MOTION_DOT":-2.218e-5,"MEAN_MOTION_DDOT":0}]"#;

const SPACE_TRACK_JSON: &str = r#"[{"CCSDS_OMM_VERS":"2.0","COMMENT":"GENERATED VIA SPACE-TRACK.ORG API",
"CREATION_DATE":"2020-07-13T01:06:16","ORIGINATOR":"18 SPCS","OBJECT_NAME":"ISS (ZARYA)","OBJECT_ID":"1998-067A",
"CENTER_NAME":"EARTH","REF_FRAME":"TEME","TIME_SYSTEM":"UTC","MEAN_ELEMENT_THEORY":"SGP4",
"EPOCH":"2020-194T21:16:01.000416Z","MEAN_MOTION":"15.49507896","ECCENTRICITY":"0.00014130","INCLINATION":"51.6461",
"RA_OF_ASC_NODE":"221.2784","ARG_OF_PERICENTER":"89.1723","MEAN_ANOMALY":"280.4612","EPHEMERIS_TYPE":"0",
"CLASSIFICATION_TYPE":"U","NORAD_CAT_ID":"25544","ELEMENT_SET_NO":"999","REV_AT_EPOCH":"23600",
"BSTAR":"-0.00003151500000","MEAN_MOTION_DOT":"-0.00002218","MEAN_MOTION_DDOT":"0.0000000000000",
"SEMIMAJOR_AXIS":"6797.000","PERIOD":"92.933","DECAY_DATE":null,"GP_ID":"159480301"}]"#;

const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<ndm xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="https://sanaregistry.org/r/ndmxml/ndmxml-1.0-master.xsd">
<omm id="CCSDS_OMM_VERS" version="2.0"><header><CREATION_DATE/><ORIGINATOR/></header><body><segment>
<metadata><OBJECT_NAME>ISS (ZARYA)</OBJECT_NAME><OBJECT_ID>1998-067A</OBJECT_ID><CENTER_NAME>EARTH</CENTER_NAME>
<REF_FRAME>TEME</REF_FRAME><TIME_SYSTEM>UTC</TIME_SYSTEM><MEAN_ELEMENT_THEORY>SGP4</MEAN_ELEMENT_THEORY></metadata>
<data><meanElements><EPOCH>2020-07-12T21:16:01.000416</EPOCH><MEAN_MOTION units="rev/day">15.49507896</MEAN_MOTION>
<ECCENTRICITY>.0001413</ECCENTRICITY><INCLINATION>51.6461</INCLINATION><RA_OF_ASC_NODE>221.2784</RA_OF_ASC_NODE>
<ARG_OF_PERICENTER>89.1723</ARG_OF_PERICENTER><MEAN_ANOMALY>280.4612</MEAN_ANOMALY></meanElements>
<tleParameters><EPHEMERIS_TYPE>0</EPHEMERIS_TYPE><CLASSIFICATION_TYPE>U</CLASSIFICATION_TYPE>
<NORAD_CAT_ID>25544</NORAD_CAT_ID><ELEMENT_SET_NO>999</ELEMENT_SET_NO><REV_AT_EPOCH>23600</REV_AT_EPOCH>
<BSTAR>-.31515E-4</BSTAR><MEAN_MOTION_DOT>-.2218E-4</MEAN_MOTION_DOT><MEAN_MOTION_DDOT>0</MEAN_MOTION_DDOT>
</tleParameters></data></segment></body></omm>
</ndm>"#;

const TLE: &str = "ISS (ZARYA)
1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992
2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008";

fn read(text: &str) -> Vec<Result<Found, SetError>> {
    formats::sets(text, Checksums::Strict).unwrap().collect()
}

fn only(text: &str) -> Elements {
    let mut sets = read(text);
    assert_eq!(sets.len(), 1, "{sets:?}");
    sets.remove(0).unwrap().elements
}

fn bare(mut elements: Elements) -> Elements {
    elements.further.clear();
    elements
}

fn told(text: &str) -> Vec<String> {
    let tell = |set: Result<Found, SetError>| match set {
        Ok(found) => format!("{} at line {}", found.elements.label(), found.line),
        Err(error) => error.to_string(),
    };
    read(text).into_iter().map(tell).collect()
}

#[test]
fn all_forms_of_one_object_are_one_set_of_elements() {
    let wanted = only(TLE);
    let header: Vec<String> = formats::write(Form::OmmCsv, std::slice::from_ref(&wanted))
        .unwrap()
        .lines()
        .map(str::to_owned)
        .collect();
    let order = "OBJECT_NAME,OBJECT_ID,EPOCH,MEAN_MOTION,ECCENTRICITY,INCLINATION,RA_OF_ASC_NODE,ARG_OF_PERICENTER,MEAN_ANOMALY,\
                 EPHEMERIS_TYPE,CLASSIFICATION_TYPE,NORAD_CAT_ID,ELEMENT_SET_NO,REV_AT_EPOCH,BSTAR,MEAN_MOTION_DOT,MEAN_MOTION_DDOT";
    assert_eq!(header[0], order);
    let csv = format!(
        "{order}\r\nISS (ZARYA),1998-067A,2020-07-12T21:16:01.000416,15.49507896,.0001413,51.6461,221.2784,89.1723,280.4612,0,U,25544,999,23600,-.31515E-4,-.2218E-4,0\r\n"
    );
    for text in [KVN, CELESTRAK_JSON, SPACE_TRACK_JSON, XML, &csv] {
        assert_eq!(bare(only(text)), wanted, "{text}");
    }
    assert_eq!(only(KVN).further, [("COMMENT".to_owned(), "from a friend".to_owned())]);
    let further = only(SPACE_TRACK_JSON).further;
    let keys: Vec<&str> = further.iter().map(|(key, _)| key.as_str()).collect();
    assert_eq!(keys, ["COMMENT", "CREATION_DATE", "ORIGINATOR", "SEMIMAJOR_AXIS", "PERIOD", "GP_ID"]);
}

#[test]
fn columns_of_csv_are_found_by_name() {
    let text = formats::write(Form::OmmCsv, &[only(TLE)]).unwrap();
    let turned: Vec<String> = text
        .lines()
        .map(|line| line.split(',').rev().map(|cell| format!("\"{cell}\"")).collect::<Vec<_>>().join(", "))
        .collect();
    assert_eq!(only(&turned.join("\n")), only(TLE));
}

#[test]
fn further_keys_survive_every_form_of_omm() {
    let mut elements = only(SPACE_TRACK_JSON);
    elements.further.push(("MY NOTE".to_owned(), "a < b & \"c\", d = [e]".to_owned()));
    elements.norad_cat_id = None;
    elements.object_id = None;
    for form in [Form::OmmJson, Form::OmmCsv, Form::OmmXml, Form::OmmKvn] {
        let text = formats::write(form, &[elements.clone(), elements.clone()]).unwrap();
        let sets = read(&text);
        assert_eq!(sets.len(), 2);
        for set in sets {
            assert_eq!(set.unwrap().elements, elements, "{text}");
        }
    }
    elements.further[0].1 = "two\nlines".to_owned();
    for form in [Form::OmmJson, Form::OmmXml, Form::OmmKvn] {
        let text = formats::write(form, std::slice::from_ref(&elements)).unwrap();
        assert_eq!(only(&text), elements, "{text}");
    }
}

#[test]
fn semi_major_axis_may_stand_for_the_mean_motion() {
    let text = KVN.replace("MEAN_MOTION         = 15.49507896 [rev/day]", "SEMI_MAJOR_AXIS = 6796.993 [km]");
    let elements = only(&text);
    assert!((elements.mean_motion_rev_day - 15.495).abs() < 1e-2, "{}", elements.mean_motion_rev_day);
    assert!(Propagator::new(&elements).is_ok());
}

#[test]
fn other_frames_times_centres_and_theories_are_refused_where_they_stand() {
    for (from, to, wanted) in [
        ("= TEME", "= GCRF", "line 8 (ISS (ZARYA)): REF_FRAME is 'GCRF', wanted TEME"),
        ("= UTC", "= TAI", "line 9 (ISS (ZARYA)): TIME_SYSTEM is 'TAI', wanted UTC"),
        ("= EARTH", "= MARS", "line 7 (ISS (ZARYA)): CENTER_NAME is 'MARS', wanted EARTH"),
        ("= SGP4", "= SGP4-XP", "line 10 (ISS (ZARYA)): the elements are made for SGP4-XP, not for SGP4"),
        (
            "BSTAR               = -.31515E-4",
            "BTERM = 0.02\nAGOM = 0.01",
            "the elements are made for SGP4-XP (BTERM instead",
        ),
        (
            "EPHEMERIS_TYPE      = 0",
            "EPHEMERIS_TYPE = 4",
            "line 18 (ISS (ZARYA)): the elements are made for SGP4-XP (EPHEMERIS_TYPE 4)",
        ),
        ("= 51.6461 [deg]", "= fifty", "line 14 (ISS (ZARYA)): INCLINATION is 'fifty', wanted a number"),
        ("= 51.6461 [deg]", "= nan", "line 14 (ISS (ZARYA)): INCLINATION is 'nan', wanted a number"),
        ("= 51.6461 [deg]", "= 181", "INCLINATION is '181', wanted 0 to 180 degrees"),
        ("INCLINATION         = 51.6461 [deg]\n", "", "line 1 (ISS (ZARYA)): INCLINATION is missing"),
        ("BSTAR               = -.31515E-4\n", "", "BSTAR is missing: without it there is no orbit"),
        (
            "= 2020-07-12T21:16:01.000416",
            "= yesterday",
            "line 11 (ISS (ZARYA)): EPOCH is 'yesterday', wanted an instant in UTC",
        ),
        ("= .0001413", "= 1.0", "ECCENTRICITY is '1', wanted 0 to below 1"),
        (
            "OBJECT_ID ",
            "EPOCH = 2020-07-12T21:16:01\nOBJECT_ID ",
            "line 12 (ISS (ZARYA)): EPOCH stands there twice",
        ),
        (
            "CLASSIFICATION_TYPE = U",
            "what is this",
            "line 19 (ISS (ZARYA)): broken KVN: 'what is this' is no KEY = value",
        ),
    ] {
        let text = KVN.replacen(from, to, 1);
        assert_ne!(text, KVN, "{from}");
        let found = told(&text);
        assert!(found.len() == 1 && found[0].contains(wanted), "{found:?}\nwanted {wanted}");
    }
}

#[test]
fn broken_set_does_not_stop_a_file_of_any_form() {
    let object = |name: &str| CELESTRAK_JSON[1..CELESTRAK_JSON.len() - 1].replace("ISS (ZARYA)", name);
    let cut = object("CUT").split("\"BSTAR").next().unwrap().to_owned();
    let unquoted = object("OPEN").replace("\"1998-067A\"", "\"1998-067A");
    let json = format!("[{},\n{cut}\n{},\n{unquoted},\n{},\n{cut}", object("A"), object("B"), object("C"));
    let found = told(&json);
    assert_eq!(found.len(), 6, "{found:?}");
    for (index, wanted) in [
        (0, "A at line 1"),
        (1, "line 3: broken JSON"),
        (2, "B at line 3"),
        (3, "line 4: broken JSON"),
        (4, "C at line 5"),
        (5, "line 6: broken JSON"),
    ] {
        assert!(found[index].starts_with(wanted), "{found:?}");
    }

    let (head, rest) = XML.split_once("<omm").unwrap();
    let message = format!("<omm{}", rest.split_once("</ndm>").unwrap().0);
    let named = |name: &str| message.replace("ISS (ZARYA)", name);
    let broken = named("TORN").replace("</ECCENTRICITY>", "");
    let cut = named("CUT").split("<MEAN_ANOMALY>").next().unwrap().to_owned();
    let xml = format!("{head}{}{broken}{}{cut}{}{cut}</ndm>", named("A"), named("B"), named("C"));
    let found = told(&xml);
    assert_eq!(found.len(), 6, "{found:?}");
    assert!(found[0].starts_with("A at line 3") && found[2].starts_with("B at"), "{found:?}");
    assert!(found[1].contains("(TORN): broken XML"), "{found:?}");
    assert!(found[3].contains("(CUT): ") && found[4].starts_with("C at"), "{found:?}");

    let kvn =
        format!("{}{}{KVN}", KVN.replace("ISS", "A"), KVN.replace("ISS", "B").replace("= 51.6461 [deg]", ""));
    let found = told(&kvn);
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(
        found[1].contains("'INCLINATION' is no KEY") && found[2] == "ISS (ZARYA) at line 51",
        "{found:?}"
    );

    let csv = formats::write(Form::OmmCsv, &[only(TLE), only(TLE), only(TLE), only(TLE)]).unwrap();
    let mut lines: Vec<String> = csv.lines().map(str::to_owned).collect();
    lines[2] = lines[2].replace("1998-067A,", "");
    lines[3] = lines[3].replace("ISS (ZARYA)", "\"ISS");
    let found = told(&lines.join("\n"));
    assert_eq!(found[0], "ISS (ZARYA) at line 2");
    assert_eq!(found[1], "line 3 (ISS (ZARYA)): broken CSV: 16 values for 17 columns");
    assert_eq!(found[2], "line 4: broken CSV: a quotation mark is not closed");
    assert_eq!(found[3], "ISS (ZARYA) at line 5");
}

#[test]
fn lone_omm_and_objects_without_an_array_are_legal() {
    let lone = &XML[XML.find("<omm").unwrap()..XML.find("</ndm>").unwrap()];
    assert_eq!(only(lone), only(TLE));
    let object = &CELESTRAK_JSON[1..CELESTRAK_JSON.len() - 1];
    assert_eq!(only(object), only(TLE));
    assert_eq!(read(&format!("{object}\n{object}\n")).len(), 2);
}

#[test]
fn endless_and_hollow_texts_take_no_endless_time() {
    // Quadratic readers would need hours for these.
    for text in [
        format!("{{\"EPOCH\":1,{}\"B\":1}}", "\"A\":1,".repeat(200_000)),
        "{\"EPOCH\"".repeat(200_000),
        "<omm>".repeat(200_000),
        "<omm><a>".repeat(200_000),
        format!("CCSDS_OMM_VERS = 2.0\n{}", "COMMENT x\n".repeat(200_000)),
        format!("EPOCH,INCLINATION\n{}", "\"\n".repeat(200_000)),
        "1 25544U 98067A   20194.88612269\n".repeat(100_000),
    ] {
        assert!(read(&text).iter().all(Result::is_err));
    }
}
