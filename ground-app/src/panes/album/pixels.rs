//! From the bytes of a JPEG as far as they are held to a texture: decoded on a thread of its own.

use std::io::Cursor;
use std::sync::{Arc, Mutex, PoisonError};

use api::client::ImageFile;
use egui::{ColorImage, TextureHandle, TextureOptions};
use image::{ImageDecoder as _, ImageReader, Limits};

/// No picture has more pixels on one side, nor takes more memory.
const SIDE_MAX: u32 = 8192;
const BYTES_MAX: u64 = 256 << 20;

type Decoded = Result<ColorImage, String>;

/// The picture.
#[derive(Default)]
pub(in crate::panes) struct Pixels {
    working: Option<Arc<Mutex<Option<Decoded>>>>,
    waiting: Option<Vec<u8>>,
    texture: Option<TextureHandle>,
    failure: Option<String>,
}

impl Pixels {
    /// Takes what is held; of what comes while one is decoded only the last counts.
    pub(super) fn decode(&mut self, file: &ImageFile) {
        let from_beginning = usize::try_from(file.contiguous_bytes).unwrap_or(usize::MAX);
        let bytes = &file.bytes[..from_beginning.min(file.bytes.len())];
        self.waiting = Some(bytes.to_vec());
    }

    pub(super) fn turn(&mut self, context: &egui::Context) {
        if let Some(slot) = &self.working {
            let decoded = slot.lock().unwrap_or_else(PoisonError::into_inner).take();
            match decoded {
                Some(Ok(picture)) => {
                    self.failure = None;
                    match &mut self.texture {
                        Some(texture) => texture.set(picture, TextureOptions::LINEAR),
                        None => {
                            self.texture =
                                Some(context.load_texture("picture", picture, TextureOptions::LINEAR));
                        }
                    }
                    self.working = None;
                }
                Some(Err(why)) => {
                    self.failure = Some(why);
                    self.working = None;
                }
                // Its thread died.
                None if Arc::strong_count(slot) == 1 => self.working = None,
                None => {}
            }
        }
        if self.working.is_some() {
            return;
        }
        let Some(bytes) = self.waiting.take() else { return };
        let slot = Arc::new(Mutex::new(None));
        let (done, context) = (Arc::clone(&slot), context.clone());
        let work = move || {
            let decoded = decode(bytes);
            *done.lock().unwrap_or_else(PoisonError::into_inner) = Some(decoded);
            context.request_repaint();
        };
        match std::thread::Builder::new().name("picture".to_owned()).spawn(work) {
            Ok(_) => self.working = Some(slot),
            Err(error) => self.failure = Some(format!("this machine gives no thread: {error}")),
        }
    }

    /// The picture as far as it could be decoded.
    pub(in crate::panes) fn texture(&self) -> Option<&TextureHandle> {
        self.texture.as_ref()
    }

    pub(super) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }
}

/// What is missing at the end stays grey.
fn decode(mut bytes: Vec<u8>) -> Decoded {
    if bytes.len() < 4 {
        return Err("the beginning of the picture is missing".to_owned());
    }
    // A file that is cut ends as a whole one does.
    bytes.extend([0xFF, 0xD9]);
    let mut reader = ImageReader::new(Cursor::new(bytes));
    reader.set_format(image::ImageFormat::Jpeg);
    let mut limits = Limits::default();
    limits.max_image_width = Some(SIDE_MAX);
    limits.max_image_height = Some(SIDE_MAX);
    limits.max_alloc = Some(BYTES_MAX);
    reader.limits(limits);
    let told = |error: image::ImageError| format!("not to be shown yet: {error}");
    let decoder = reader.into_decoder().map_err(told)?;
    let (width, height) = decoder.dimensions();
    let picture = image::DynamicImage::from_decoder(decoder).map_err(told)?.into_rgb8();
    Ok(ColorImage::from_rgb([width as usize, height as usize], picture.as_raw()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jpeg() -> Vec<u8> {
        let picture = image::RgbImage::from_fn(160, 120, |x, y| image::Rgb([x as u8, 2 * y as u8, 90]));
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn what_is_held_is_shown_and_rubbish_is_told() {
        let whole = jpeg();
        let shown = decode(whole.clone()).unwrap();
        assert_eq!(shown.size, [160, 120]);
        let half = decode(whole[..whole.len() * 6 / 10].to_vec()).unwrap();
        assert_eq!(half.size, [160, 120]);
        assert_eq!(half.pixels[20 * 160 + 20], shown.pixels[20 * 160 + 20], "the beginning is the same");
        assert!(decode(vec![0; 400]).unwrap_err().contains("not to be shown"));
        assert!(decode(Vec::new()).is_err());
    }
}
