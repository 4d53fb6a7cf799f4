//! Dynamic zones.

use std::f64::consts::{PI, TAU};

use geometry::{DetectedCycle, DynamicZone, ReturnSpan, ZoneSource};

use super::ConvertError;
use super::pose::header_of;
use crate::stillmap_msgs::{DynamicZone as ZoneMessage, DynamicZones};

/// By how much rounding may carry a bound beyond its limit.
const ROUNDING_RAD: f64 = 1e-9;

/// The zones of a message, whose header and cycle say where they belong.
///
/// # Errors
/// When a zone's bounds are no wedge, or its deviation is no deviation.
pub fn zones_from_message(message: &DynamicZones) -> Result<Vec<DynamicZone>, ConvertError> {
    zones_from_messages(&message.zones)
}

/// The zones of one cycle as a message of their own.
#[must_use]
pub fn message_from_zones(cycle: &DetectedCycle) -> DynamicZones {
    DynamicZones {
        header: header_of(cycle.reduced_cloud.stamp, &cycle.reduced_cloud.frame_id),
        cycle: cycle.index,
        zones: messages_from_zones(&cycle.zones),
    }
}

pub(super) fn zones_from_messages(
    messages: &[ZoneMessage],
) -> Result<Vec<DynamicZone>, ConvertError> {
    messages.iter().enumerate().map(|(index, message)| zone_from_message(index, message)).collect()
}

pub(super) fn messages_from_zones(zones: &[DynamicZone]) -> Vec<ZoneMessage> {
    zones
        .iter()
        .map(|zone| ZoneMessage {
            azimuth_min_rad: zone.azimuth_min_rad,
            azimuth_max_rad: zone.azimuth_max_rad,
            peak_std_dev_m: zone.peak_std_dev_m,
            held_cycles: match zone.source {
                ZoneSource::Measured => 0,
                ZoneSource::Held { cycles } => cycles,
            },
            has_returns: zone.returns.is_some(),
            nearest_return_m: zone.returns.map_or(0.0, |span| span.nearest_m),
            farthest_return_m: zone.returns.map_or(0.0, |span| span.farthest_m),
        })
        .collect()
}

fn zone_from_message(index: usize, message: &ZoneMessage) -> Result<DynamicZone, ConvertError> {
    let ZoneMessage { azimuth_min_rad, azimuth_max_rad, peak_std_dev_m, held_cycles, .. } =
        *message;
    // Comparisons with NaN are false, so that NaN is no wedge either.
    let is_wedge = azimuth_min_rad.abs() <= PI + ROUNDING_RAD
        && azimuth_max_rad >= azimuth_min_rad
        && azimuth_max_rad - azimuth_min_rad <= TAU + ROUNDING_RAD;
    if !is_wedge {
        return Err(ConvertError::ZoneBounds { index, azimuth_min_rad, azimuth_max_rad });
    }
    if !(peak_std_dev_m.is_finite() && peak_std_dev_m >= 0.0) {
        return Err(ConvertError::ZonePeak { index, peak_std_dev_m });
    }
    let source = match held_cycles {
        0 => ZoneSource::Measured,
        cycles => ZoneSource::Held { cycles },
    };
    let returns = returns_from_message(index, message)?;
    Ok(DynamicZone { azimuth_min_rad, azimuth_max_rad, peak_std_dev_m, source, returns })
}

fn returns_from_message(
    index: usize,
    message: &ZoneMessage,
) -> Result<Option<ReturnSpan>, ConvertError> {
    let (nearest_m, farthest_m) = (message.nearest_return_m, message.farthest_return_m);
    if !message.has_returns {
        return Ok(None);
    }
    if !(nearest_m >= 0.0 && farthest_m >= nearest_m && farthest_m.is_finite()) {
        return Err(ConvertError::ZoneReturns { index, nearest_m, farthest_m });
    }
    Ok(Some(ReturnSpan { nearest_m, farthest_m }))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn message(azimuth_min_rad: f64, azimuth_max_rad: f64, peak_std_dev_m: f32) -> ZoneMessage {
        ZoneMessage { azimuth_min_rad, azimuth_max_rad, peak_std_dev_m, ..ZoneMessage::default() }
    }

    #[test]
    fn zones_that_are_none_are_named_by_their_place() {
        for (least, most) in [
            (0.2, 0.1),
            (f64::NAN, 1.0),
            (0.0, f64::NAN),
            (-4.0, 0.0),
            (0.0, 7.0),
            (0.0, f64::INFINITY),
        ] {
            let error = zones_from_messages(&[message(0.0, 1.0, 0.5), message(least, most, 0.5)])
                .unwrap_err();
            assert!(matches!(error, ConvertError::ZoneBounds { index: 1, .. }), "{error}");
        }
        for (nearest_return_m, farthest_return_m) in [(2.0, 1.0), (f32::NAN, 1.0), (-1.0, 1.0)] {
            let zone = ZoneMessage {
                has_returns: true,
                nearest_return_m,
                farthest_return_m,
                ..message(0.0, 1.0, 0.5)
            };
            let error = zones_from_messages(&[zone]).unwrap_err();
            assert!(matches!(error, ConvertError::ZoneReturns { index: 0, .. }), "{error}");
        }
        for peak in [f32::NAN, -0.1, f32::INFINITY] {
            let error = zones_from_messages(&[message(0.0, 1.0, peak)]).unwrap_err();
            assert!(matches!(error, ConvertError::ZonePeak { index: 0, .. }), "{error}");
        }
    }

    proptest! {
        #[test]
        fn a_zone_comes_back(
            azimuth_min_rad in -PI..=PI,
            width_rad in 0.0..=TAU,
            peak_std_dev_m in 0.0..2.0_f32,
            held_cycles in prop_oneof![Just(0), any::<u32>()],
            has_returns in any::<bool>(),
        ) {
            let source = match held_cycles {
                0 => ZoneSource::Measured,
                cycles => ZoneSource::Held { cycles },
            };
            let azimuth_max_rad = azimuth_min_rad + width_rad;
            let returns = has_returns.then_some(ReturnSpan { nearest_m: 1.25, farthest_m: 1.5 });
            let zone =
                DynamicZone { azimuth_min_rad, azimuth_max_rad, peak_std_dev_m, source, returns };
            prop_assert_eq!(zones_from_messages(&messages_from_zones(&[zone])), Ok(vec![zone]));
        }
    }
}
