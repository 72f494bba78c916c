//! How the kit names things: as the code does, in snake case, with the unit at the end.

/// `ImageInfo` as `image_info`.
pub(crate) fn snake(name: &str) -> String {
    let mut out = String::new();
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(letter.to_ascii_lowercase());
    }
    out
}

/// The path of a field: `r_teme.x` in km is `["r_teme_km", "x"]`, `event.time` in ms `["events", "time_ms"]`.
pub(crate) fn path(name: &str, unit: &str) -> Vec<String> {
    let suffix = match unit {
        "" => "",
        "km" => "_km",
        "km/s" => "_km_s",
        "T" => "_t",
        "rad/s" => "_rad_s",
        "m/s²" => "_m_s2",
        "MRP" => "_mrp",
        "N·m" => "_n_m",
        "°C" => "_c",
        "ms" => "_ms",
        "s" => "_s",
        "V" => "_v",
        "B" => "_bytes",
        "px" => "_px",
        other => panic!("give the unit {other} of {name} its place at the end of a name"),
    };
    match name.split_once('.') {
        Some(("event", field)) => vec!["events".to_owned(), format!("{field}{suffix}")],
        Some((vector, part)) => vec![format!("{vector}{suffix}"), part.to_owned()],
        None => vec![format!("{name}{suffix}")],
    }
}
