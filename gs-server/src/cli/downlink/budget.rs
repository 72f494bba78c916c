//! The satellite's battery and antenna, as they are written in an argument.

use std::collections::BTreeMap;

use mission::downlink::{Battery, Pointing};

/// `key=value,key=value`, each key known, each once.
fn pairs<'a>(text: &'a str, keys: &[&str]) -> Result<BTreeMap<&'a str, &'a str>, String> {
    let mut found = BTreeMap::new();
    for part in text.split(',').map(str::trim) {
        let there_are = || keys.join(", ");
        let (key, value) = part
            .split_once('=')
            .ok_or_else(|| format!("'{part}' is no key=value; there are {}", there_are()))?;
        if !keys.contains(&key) {
            return Err(format!("'{key}' is none; there are {}", there_are()));
        }
        if found.insert(key, value).is_some() {
            return Err(format!("{key} is there twice"));
        }
    }
    Ok(found)
}

fn number(values: &BTreeMap<&str, &str>, key: &str, default: Option<f64>) -> Result<f64, String> {
    let Some(text) = values.get(key) else {
        return default.ok_or_else(|| format!("{key} is missing"));
    };
    let number: f64 = text.parse().map_err(|_| format!("{key}: '{text}' is no number"))?;
    if (0.0..=1e6).contains(&number) {
        Ok(number)
    } else {
        Err(format!("{key}: {number} is out of range, 0 to 1e6"))
    }
}

/// `capacity_wh=40,charge_wh=30,floor_wh=20,sunlit_w=6,load_w=3,transmit_w=4`.
pub(super) fn battery(text: &str) -> Result<Battery, String> {
    let keys = ["capacity_wh", "charge_wh", "floor_wh", "sunlit_w", "load_w", "transmit_w"];
    let values = pairs(text, &keys)?;
    let of = |key| number(&values, key, None);
    let battery = Battery {
        capacity_wh: of("capacity_wh")?,
        charge_wh: of("charge_wh")?,
        floor_wh: of("floor_wh")?,
        sunlit_w: of("sunlit_w")?,
        load_w: of("load_w")?,
        transmit_w: of("transmit_w")?,
    };
    if battery.charge_wh > battery.capacity_wh || battery.floor_wh > battery.capacity_wh {
        return Err("charge_wh and floor_wh cannot be above capacity_wh".to_owned());
    }
    Ok(battery)
}

/// `axis=0/0/1,loose_db=6,held_db=0,settle_s=60`; all but the axis may be left out.
pub(super) fn antenna(text: &str) -> Result<Pointing, String> {
    let values = pairs(text, &["axis", "loose_db", "held_db", "settle_s"])?;
    let axis = values.get("axis").ok_or("axis is missing: give axis=X/Y/Z in body axes")?;
    let parts: Vec<f64> = axis.split('/').filter_map(|part| part.trim().parse().ok()).collect();
    let axis_body: [f64; 3] =
        parts.try_into().map_err(|_| format!("axis: '{axis}' is no direction: write X/Y/Z such as 0/0/1"))?;
    let length = axis_body.iter().map(|part| part * part).sum::<f64>().sqrt();
    if !length.is_finite() || length < 1e-6 {
        return Err(format!("axis: '{axis}' has no direction"));
    }
    Ok(Pointing {
        axis_body,
        loose_loss_db: number(&values, "loose_db", Some(6.0))?,
        held_loss_db: number(&values, "held_db", Some(0.0))?,
        settle_s: number(&values, "settle_s", Some(60.0))?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_are_read_and_what_is_wrong_is_named() {
        let text = "capacity_wh=40,charge_wh=30,floor_wh=20,sunlit_w=6,load_w=3,transmit_w=4";
        assert_eq!(battery(text).unwrap().floor_wh, 20.0);
        for (wrong, key) in [
            ("capacity_wh=40", "charge_wh is missing"),
            ("capacity=40", "'capacity' is none"),
            ("capacity_wh", "no key=value"),
            (&text.replace("charge_wh=30", "charge_wh=50"), "above capacity_wh"),
            (&text.replace("load_w=3", "load_w=-3"), "load_w: -3 is out of range"),
            (&format!("{text},load_w=3"), "twice"),
        ] {
            assert!(battery(wrong).unwrap_err().contains(key), "{wrong}");
        }
        let antenna_of = antenna("axis=0/-1/0,loose_db=4").unwrap();
        assert_eq!(
            (antenna_of.axis_body, antenna_of.loose_loss_db, antenna_of.settle_s),
            ([0.0, -1.0, 0.0], 4.0, 60.0)
        );
        for wrong in ["loose_db=4", "axis=0/0/0", "axis=1/2", "axis=a/b/c"] {
            assert!(antenna(wrong).is_err(), "{wrong}");
        }
    }
}
