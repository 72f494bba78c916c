//! Smooth repeatable noise: a hash of lattice points and sums of it at rising frequencies.

/// A well mixed hash (the finaliser of SplitMix64).
#[must_use]
pub(crate) const fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The hash as a number in 0..1.
#[must_use]
pub(crate) fn unit(value: u64) -> f32 {
    (mix(value) >> 40) as f32 / (1_u64 << 24) as f32
}

/// Value noise at a point in space, 0..1.
fn value(seed: u64, point: [f32; 3]) -> f32 {
    let cell = point.map(f32::floor);
    let fade = |axis: usize| {
        let t = point[axis] - cell[axis];
        t * t * (3.0 - 2.0 * t)
    };
    let (fx, fy, fz) = (fade(0), fade(1), fade(2));
    let corner = |dx: i64, dy: i64, dz: i64| {
        let key = |axis: usize, step: i64, odd: u64| ((cell[axis] as i64 + step) as u64).wrapping_mul(odd);
        unit(
            seed ^ key(0, dx, 0x8da6_b343_27d4_eb2f)
                ^ key(1, dy, 0xd816_3841_9e37_79b1)
                ^ key(2, dz, 0xcb1a_b31f_85eb_ca6b),
        )
    };
    let along_x = |dy, dz| {
        let low = corner(0, dy, dz);
        low + (corner(1, dy, dz) - low) * fx
    };
    let along_y = |dz| {
        let low = along_x(0, dz);
        low + (along_x(1, dz) - low) * fy
    };
    let low = along_y(0);
    low + (along_y(1) - low) * fz
}

/// Fractal noise: `octaves` of [`value`], each twice as fine and half as strong; 0..1.
#[must_use]
pub(crate) fn fractal(seed: u64, point: [f32; 3], octaves: u32) -> f32 {
    let (mut sum, mut weight, mut total, mut scale) = (0.0, 1.0, 0.0, 1.0);
    for octave in 0..octaves {
        sum += weight * value(seed.wrapping_add(u64::from(octave)), point.map(|axis| axis * scale));
        total += weight;
        weight *= 0.5;
        scale *= 2.03;
    }
    sum / total
}
