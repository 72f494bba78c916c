//! What is looked for, and the look.

use end_to_end::folder::KEY;

/// So many bytes of the key in a row are no accident.
pub(crate) const IN_A_ROW: usize = 5;

/// What is looked for: how it is spelled, and the bytes.
pub(crate) type Spellings = Vec<(String, Vec<u8>)>;

/// Every way in which somebody might write a piece of the satellite's key down by accident.
pub(crate) fn spellings() -> Spellings {
    let mut all = spellings_of(&KEY, IN_A_ROW);
    // Base64, at each place in a group of three bytes where a key may begin.
    for text in ["wP/uXsLn", "wP_uXsLn", "/+5ewucT", "_-5ewucT", "7l7C5xM3"] {
        all.push(("base64".to_owned(), text.into()));
    }
    all
}

/// The same for other bytes, but for base64.
pub(crate) fn spellings_of(secret: &[u8], in_a_row: usize) -> Spellings {
    let mut all = Vec::new();
    for (at, piece) in secret.windows(in_a_row).enumerate() {
        let join =
            |each: &dyn Fn(&u8) -> String, by: &str| piece.iter().map(each).collect::<Vec<_>>().join(by);
        let words = [
            ("hex", join(&|byte| format!("{byte:02x}"), "")),
            ("hex in pairs", join(&|byte| format!("{byte:02x}"), " ")),
            ("hex with colons", join(&|byte| format!("{byte:02x}"), ":")),
            ("hex numbers", join(&|byte| format!("0x{byte:02x}"), ", ")),
            ("Debug of hex", join(&|byte| format!("{byte:x}"), ", ")),
            ("Debug, JSON", join(&|byte| format!("{byte}"), ", ")),
            ("compact JSON", join(&|byte| format!("{byte}"), ",")),
            ("Debug in lines", join(&|byte| format!("{byte}"), ",\n    ")),
        ];
        all.push((format!("raw, from byte {at}"), piece.to_vec()));
        all.push((format!("raw, backwards, from byte {at}"), piece.iter().rev().copied().collect()));
        for (name, text) in words {
            all.push((format!("{name}, from byte {at}"), text.into_bytes()));
        }
    }
    all
}

/// Words that are looked for as they are.
pub(crate) fn words(words: &[(&str, String)]) -> Spellings {
    words.iter().map(|(name, word)| (format!("raw {name}"), word.clone().into_bytes())).collect()
}

/// Where the key stands in these bytes; hexadecimal in either case.
pub(crate) fn find(bytes: &[u8], spellings: &[(String, Vec<u8>)]) -> Option<String> {
    let (exact, any_case): (Vec<_>, Vec<_>) =
        spellings.iter().partition(|(name, _)| name.starts_with("raw") || name == "base64");
    search(bytes, &exact).or_else(|| search(&bytes.to_ascii_lowercase(), &any_case))
}

/// One walk over logs of many megabytes: what a spelling begins with is looked up before it is compared.
fn search(bytes: &[u8], spellings: &[&(String, Vec<u8>)]) -> Option<String> {
    let mut begins: Vec<Vec<usize>> = vec![Vec::new(); 1 << 16];
    let place = |two: &[u8]| usize::from(two[0]) << 8 | usize::from(two[1]);
    for (number, (_, spelling)) in spellings.iter().enumerate() {
        begins[place(spelling)].push(number);
    }
    for (at, two) in bytes.windows(2).enumerate() {
        let found = begins[place(two)].iter().map(|number| spellings[*number]);
        if let Some((name, spelling)) = { found }.find(|(_, spelling)| bytes[at..].starts_with(spelling)) {
            let around = &bytes[at.saturating_sub(60)..(at + spelling.len() + 20).min(bytes.len())];
            return Some(format!("{name}, at {at}: {}", String::from_utf8_lossy(around)));
        }
    }
    None
}

/// In Base64, as SMTP carries them.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let word = three.iter().fold(0_usize, |word, byte| word << 8 | usize::from(*byte))
            << (8 * (3 - three.len()));
        for place in 0..=three.len() {
            text.push(char::from(DIGITS[word >> (18 - 6 * place) & 63]));
        }
    }
    text
}
