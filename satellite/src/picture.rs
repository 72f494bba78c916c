//! What the camera sees: the Earth's limb with seas, land, clouds and air glow, before the stars. Drawn, not
//! photographed; the same seed draws the same picture.

use image::{GrayImage, Rgb, RgbImage, codecs::jpeg::JpegEncoder};

use crate::noise::{fractal, mix, unit};

/// How a picture is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureSettings {
    /// Everything in the picture follows from this.
    pub seed: u64,
    /// Width, pixels.
    pub width_px: u16,
    /// Height, pixels.
    pub height_px: u16,
    /// Without colour.
    pub grey: bool,
    /// Smaller file, coarser picture.
    pub strong_compression: bool,
}

const QUALITY: u8 = 76;
const QUALITY_STRONG: u8 = 38;

/// Draws the picture and encodes it as a baseline JPEG. Empty only if a side is 0.
#[must_use]
pub fn take(settings: &PictureSettings) -> Vec<u8> {
    let scene = Scene::new(settings);
    let (width, height) = (u32::from(settings.width_px), u32::from(settings.height_px));
    let picture = RgbImage::from_fn(width, height, |x, y| scene.pixel(x, y));
    let quality = if settings.strong_compression { QUALITY_STRONG } else { QUALITY };
    let mut jpeg = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut jpeg, quality);
    let encoded = if settings.grey {
        let grey = GrayImage::from_fn(width, height, |x, y| {
            let Rgb([red, green, blue]) = *picture.get_pixel(x, y);
            let luma = 0.299 * f32::from(red) + 0.587 * f32::from(green) + 0.114 * f32::from(blue);
            image::Luma([luma.round() as u8])
        });
        encoder.encode_image(&grey)
    } else {
        encoder.encode_image(&picture)
    };
    // writing to memory fails for a picture without pixels alone
    encoded.map_or_else(|_| Vec::new(), |()| jpeg)
}

type Colour = [f32; 3];

fn blend(from: Colour, to: Colour, share: f32) -> Colour {
    let share = share.clamp(0.0, 1.0);
    [0, 1, 2].map(|channel| from[channel] + (to[channel] - from[channel]) * share)
}

fn add(colour: Colour, light: Colour, strength: f32) -> Colour {
    [0, 1, 2].map(|channel| colour[channel] + light[channel] * strength)
}

fn step(low: f32, high: f32, value: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Where the Earth stands in the picture and from where the sun shines. Lengths in pixels.
struct Scene {
    seed: u64,
    scale: f32,
    centre: [f32; 2],
    radius: f32,
    sun: [f32; 3],
    turn: f32,
}

impl Scene {
    fn new(settings: &PictureSettings) -> Self {
        let (width, height) = (f32::from(settings.width_px), f32::from(settings.height_px));
        let pick = |key: u64| unit(mix(settings.seed) ^ key);
        let radius = height * (1.25 + 0.35 * pick(1));
        let horizon = height * (0.30 + 0.12 * pick(2));
        let sun_side = if pick(3) < 0.5 { -1.0 } else { 1.0 };
        let sun = [sun_side * (0.45 + 0.25 * pick(4)), -0.35 - 0.2 * pick(5), 0.62];
        let length = sun.iter().map(|axis| axis * axis).sum::<f32>().sqrt();
        Self {
            seed: mix(settings.seed ^ 0x0e17),
            scale: height / 304.0,
            centre: [width * (0.35 + 0.3 * pick(6)), horizon + radius],
            radius,
            sun: sun.map(|axis| axis / length),
            turn: std::f32::consts::TAU * pick(7),
        }
    }

    fn pixel(&self, x: u32, y: u32) -> Rgb<u8> {
        let (dx, dy) = (x as f32 + 0.5 - self.centre[0], y as f32 + 0.5 - self.centre[1]);
        let distance = dx.hypot(dy);
        let lit = step(-0.35, 0.5, (dx * self.sun[0] + dy * self.sun[1]) / distance.max(1.0));
        let height = distance - self.radius;
        let mut colour = if height < 0.0 {
            let nz = (1.0 - (distance / self.radius).powi(2)).max(0.0).sqrt();
            self.ground([dx / self.radius, dy / self.radius, nz])
        } else {
            self.stars(x, y, height)
        };
        // one pixel of soft edge, then two layers of air: white and thin, blue and deep
        let over = height.max(0.0) / self.scale;
        let inside = (-height).max(0.0) / self.scale;
        colour = add(colour, [0.75, 0.88, 1.0], 0.85 * lit * (-over / 2.2).exp() * (-inside / 5.0).exp());
        colour = add(
            colour,
            [0.16, 0.38, 0.95],
            (0.08 + 0.85 * lit) * (-over / 9.0).exp() * (-inside / 34.0).exp(),
        );
        colour = add(colour, [0.05, 0.30, 0.14], 0.16 * (-((over - 13.0) / 2.5).powi(2)).exp());
        let grain = (unit(self.seed ^ (u64::from(x) << 32 | u64::from(y))) - 0.5) * 0.018;
        Rgb(colour.map(|channel| ((channel + grain).clamp(0.0, 1.0).powf(0.86) * 255.0).round() as u8))
    }

    /// Surface and clouds at a point of the unit sphere, lit by the sun.
    fn ground(&self, normal: [f32; 3]) -> Colour {
        let (sin, cos) = self.turn.sin_cos();
        let point = [
            normal[0] * cos + normal[2] * sin + 3.0,
            normal[1] + 5.0,
            normal[2] * cos - normal[0] * sin + 7.0,
        ];
        let land = fractal(self.seed, point.map(|axis| axis * 3.1), 6);
        let dry = fractal(self.seed ^ 0xd1, point.map(|axis| axis * 5.0), 4);
        let sea = blend([0.012, 0.06, 0.19], [0.03, 0.26, 0.34], step(0.43, 0.525, land));
        let soil = blend([0.10, 0.23, 0.08], [0.52, 0.40, 0.24], step(0.42, 0.60, dry));
        let soil = blend(soil, [0.42, 0.36, 0.30], step(0.60, 0.72, land));
        let surface = blend(sea, soil, step(0.522, 0.532, land));

        let swirl = fractal(self.seed ^ 0x51, point.map(|axis| axis * 2.3), 3) - 0.5;
        let warped =
            [point[0] * 4.3 + 3.2 * swirl, point[1] * 7.5 - 2.4 * swirl, point[2] * 4.3 + 1.6 * swirl];
        let cloud = step(0.50, 0.70, fractal(self.seed ^ 0xc1, warped, 6));

        let sunlight =
            (normal[0] * self.sun[0] + normal[1] * self.sun[1] + normal[2] * self.sun[2]).max(-0.2);
        let day = step(-0.10, 0.35, sunlight) * (0.35 + 0.75 * sunlight.max(0.0));
        // the sun's mirror image on open water
        let mirror = (2.0 * sunlight * normal[2] - self.sun[2]).max(0.0).powi(24);
        let glint = mirror * (1.0 - step(0.50, 0.53, land)) * (1.0 - cloud);
        let colour = blend(surface, [0.97, 0.98, 1.0], 0.93 * cloud).map(|channel| channel * day);
        let colour = add(colour, [1.0, 0.86, 0.62], 0.55 * glint);
        // terminator: red light just before the night
        let dusk = step(-0.12, 0.02, sunlight) * (1.0 - step(0.02, 0.22, sunlight));
        add(colour, [0.30, 0.11, 0.03], 0.35 * dusk * (0.3 + cloud))
    }

    /// The night sky: at most one star in each cell of the sky.
    fn stars(&self, x: u32, y: u32, height: f32) -> Colour {
        let dark = [0.004, 0.005, 0.012];
        let cell = (9.0 * self.scale).max(1.0) as u32;
        let key = mix(self.seed ^ (u64::from(x / cell) << 20 | u64::from(y / cell)));
        if unit(key) > 0.11 || height < 20.0 * self.scale {
            return dark;
        }
        let place = |salt: u64| (unit(key ^ salt) * cell as f32) + 0.5;
        let (dx, dy) = ((x % cell) as f32 - place(0xa), (y % cell) as f32 - place(0xb));
        let size = 0.9 * self.scale.max(0.8);
        let light = (0.25 + 0.9 * unit(key ^ 0xc).powi(3)) * (-(dx * dx + dy * dy) / (size * size)).exp();
        let warmth = unit(key ^ 0xd);
        add(dark, [0.85 + 0.15 * warmth, 0.9, 1.0 - 0.2 * warmth], light)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CIF: PictureSettings =
        PictureSettings { seed: 1, width_px: 408, height_px: 304, grey: false, strong_compression: false };

    #[test]
    fn a_cif_picture_is_a_jpeg_of_15_to_30_kilobytes() {
        for seed in 0..12 {
            let jpeg = take(&PictureSettings { seed, ..CIF });
            assert!((15_000..30_000).contains(&jpeg.len()), "seed {seed}: {} bytes", jpeg.len());
            let decoded = image::load_from_memory(&jpeg).unwrap();
            assert_eq!((decoded.width(), decoded.height()), (408, 304));
        }
    }

    #[test]
    fn the_seed_decides_the_picture() {
        assert_eq!(take(&CIF), take(&CIF));
        assert_ne!(take(&CIF), take(&PictureSettings { seed: 2, ..CIF }));
    }

    #[test]
    fn grey_and_strong_compression_make_smaller_files() {
        let plain = take(&CIF).len();
        assert!(take(&PictureSettings { grey: true, ..CIF }).len() < plain);
        assert!(take(&PictureSettings { strong_compression: true, ..CIF }).len() < plain * 3 / 4);
    }

    #[test]
    fn a_picture_without_pixels_is_empty() {
        assert!(take(&PictureSettings { width_px: 0, ..CIF }).is_empty());
    }
}
