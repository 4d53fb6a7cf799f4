//! Random numbers on a lattice, and the noise between them.

/// A 32-bit hash of a lattice point: multiply and shift, as in `noise`, in half the width.
pub(super) fn bits(column: i32, row: i32, seed: u32) -> u32 {
    let mixed = (column as u32)
        .wrapping_mul(0x9e37_79b1)
        .wrapping_add((row as u32).wrapping_mul(0x85eb_ca77))
        ^ seed.wrapping_mul(0xc2b2_ae3d);
    let mixed = (mixed ^ (mixed >> 16)).wrapping_mul(0x7feb_352d);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x846c_a68b);
    mixed ^ (mixed >> 16)
}

/// A number in `[0, 1)` for a lattice point.
pub(super) fn unit(column: i32, row: i32, seed: u32) -> f32 {
    share(bits(column, row, seed))
}

/// The upper 24 bits as a number in `[0, 1)`.
pub(super) fn share(bits: u32) -> f32 {
    (bits >> 8) as f32 / 16_777_216.0
}

/// The floor, by a cast, since `f32::floor` would be a function call.
pub(super) fn floor(value: f32) -> i32 {
    let towards_zero = value as i32;
    towards_zero.saturating_sub(i32::from(towards_zero as f32 > value))
}

/// Value noise in `[-1, 1]`: random at whole coordinates, smooth between them (cubic blend).
pub(super) fn value_noise(u: f32, v: f32, seed: u32) -> f32 {
    let (column, row) = (floor(u), floor(v));
    let blend = |t: f32| t * t * (3.0 - 2.0 * t);
    let (across, down) = (blend(u - column as f32), blend(v - row as f32));
    let at = |i: i32, j: i32| unit(column.wrapping_add(i), row.wrapping_add(j), seed);
    let mix = |a: f32, b: f32, share: f32| a + (b - a) * share;
    let value = mix(mix(at(0, 0), at(1, 0), across), mix(at(0, 1), at(1, 1), across), down);
    2.0 * value - 1.0
}

/// The most octaves of a noise: from 1 m down to less than a millimetre.
const MAX_OCTAVES: u32 = 10;
/// The ratio of the amplitudes of successive octaves. Below 1/2 a surface looks washed out at close range; near 1 it is
/// white noise.
const PERSISTENCE: f32 = 0.65;

/// Value noise of several octaves, each half as large as the one before it, with a deviation of about a third. Spots
/// smaller than `finest_m` would alias and are left out; they fade in above it.
pub(super) fn octaves(u_m: f32, v_m: f32, size_m: f32, finest_m: f32, seed: u32) -> f32 {
    let (mut spot_m, mut weight, mut sum) = (size_m, 1.0, 0.0);
    for octave in 0..MAX_OCTAVES {
        let visible = (spot_m / finest_m - 1.0).min(1.0);
        if visible <= 0.0 {
            break;
        }
        sum += visible * weight * value_noise(u_m / spot_m, v_m / spot_m, seed ^ octave);
        weight *= PERSISTENCE;
        spot_m *= 0.5;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_within_bounds_and_another_for_another_seed() {
        let (mut sum, mut differing) = (0.0, 0);
        for step in 0..20_000 {
            let (u, v) = (step as f32 * 0.013 - 120.0, step as f32 * 0.007);
            let here = value_noise(u, v, 5);
            assert!((-1.0..=1.0).contains(&here));
            // The steepest cubic blend rises by 1.5 times its span, in both directions at once.
            assert!((value_noise(u + 1e-3, v, 5) - here).abs() < 4e-3);
            assert!((value_noise(u, v + 1e-3, 5) - here).abs() < 4e-3);
            sum += here;
            differing += i32::from((value_noise(u, v, 6) - here).abs() > 0.05);
        }
        assert!((sum / 20_000.0).abs() < 0.05, "mean {}", sum / 20_000.0);
        assert!(differing > 15_000);
    }

    #[test]
    fn what_a_pixel_cannot_show_is_left_out() {
        let fine = |u: f32| octaves(u, 0.3, 0.2, 1e-4, 1) - octaves(u, 0.3, 0.2, 0.05, 1);
        assert!((0..100).any(|step| fine(step as f32 * 0.01).abs() > 0.2));
        assert_eq!(octaves(0.1, 0.3, 0.2, 0.3, 1), 0.0);
    }
}
