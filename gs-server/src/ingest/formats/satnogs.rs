//! SatNOGS DB: frames as its API tells them, and the lines of its export.

use mission::reception::{Ear, Refusal, Said};

use super::place::of_observer;
use super::tree::Object;
use super::value::{Fields, stamp};
use super::{Context, digest};

/// One element of the answer of `/api/telemetry/`.
pub(super) fn object(object: &Object<'_>, body: &[u8], context: &Context) -> Result<Said, Refusal> {
    let mut fields = Fields::of(object, mission::reception::Doubts::default());
    let hex = fields.text("frame").ok_or(Refusal::NoBytes)?;
    let (time, observer) = (fields.text("timestamp"), fields.text("observer"));
    let (norad, label) = (fields.catalogue("norad_cat_id"), fields.text("transmitter"));
    let mut said = of(hex, time, observer, context)?;
    for doubt in fields.doubts.iter() {
        said.doubts.add(doubt);
    }
    (said.norad, said.label) = (norad, label.map(str::to_owned));
    said.original = Some(body.into());
    Ok(said)
}

/// A line of the export: time, `|` (or `,` `;` tab), hex, perhaps the observer.
pub(super) fn line(body: &[u8], context: &Context) -> Result<Said, Refusal> {
    let text = std::str::from_utf8(body).map_err(|_| Refusal::Malformed)?;
    let mut parts = text.split(['|', ',', ';', '\t']).map(|part| part.trim().trim_matches('"'));
    let (time, hex, observer) = (parts.next(), parts.next(), parts.next());
    let hex = hex.ok_or(Refusal::Malformed)?;
    if time.and_then(stamp).is_none() && hex::decode(hex).is_err() {
        return Err(Refusal::NotAReport); // the names of the columns
    }
    let mut said = of(hex, time, observer.filter(|observer| !observer.is_empty()), context)?;
    said.original = Some(body.into());
    Ok(said)
}

fn of(hex: &str, time: Option<&str>, observer: Option<&str>, context: &Context) -> Result<Said, Refusal> {
    let digits: String = hex.chars().take(4_096).filter(|c| !c.is_ascii_whitespace()).collect();
    let bytes = hex::decode(digits).map_err(|_| Refusal::BadBytes)?;
    let at = time.and_then(stamp);
    let source_id = digest(&[&bytes, &at.map_or(0, |at| at.0).to_le_bytes()]);
    let mut said = context.said(Ear::Satnogs, source_id);
    said.times.stated = at.or(said.times.stated);
    if let Some(observer) = observer {
        said.receiver.id = Some(observer.to_owned());
        said.receiver.name = Some(observer.to_owned());
        let place = of_observer(observer);
        said.receiver.latitude_deg = place.map(|place| place.0);
        said.receiver.longitude_deg = place.map(|place| place.1);
    }
    said.bytes = Some(bytes);
    Ok(said)
}
