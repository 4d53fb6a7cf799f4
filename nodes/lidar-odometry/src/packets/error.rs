//! The errors of a packet.

use super::model::{Model, PACKET_BYTES};

/// Why a data packet is not decoded.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum PacketError {
    /// The datagram has another length.
    #[error("a data packet has {PACKET_BYTES} bytes, not {found}")]
    Length {
        /// Its length in bytes.
        found: usize,
    },
    /// A block does not begin with the flag of its place.
    #[error("block {block} begins with {found:#06x}, where {expected} is expected")]
    Flag {
        /// Which of the twelve blocks, from 0.
        block: usize,
        /// The value there, as a number with its least significant byte first.
        found: u16,
        /// The accepted values.
        expected: &'static str,
    },
    /// An azimuth is no angle.
    #[error("block {block} is at {found} hundredths of a degree, which is not below 36000")]
    Azimuth {
        /// Which of the twelve blocks, from 0.
        block: usize,
        /// The value there.
        found: u16,
    },
    /// The scanner would have turned backwards, or faster than any does.
    #[error(
        "the azimuth steps from {from_deg:.2} to {to_deg:.2} degrees at block {block}, by more than {limit_deg:.2} \
         forwards"
    )]
    AzimuthJump {
        /// The block after the step, from 0.
        block: usize,
        /// The azimuth of the firing before.
        from_deg: f64,
        /// The azimuth of this one.
        to_deg: f64,
        /// The largest step that is possible.
        limit_deg: f64,
    },
    /// The product id is unknown.
    #[error("the product id {id:#04x} is not known; state the model where it is certain")]
    UnknownProduct {
        /// The last byte of the packet.
        id: u8,
    },
    /// The packet is of a product that is not decoded here.
    #[error("packets of the {name} (product id {id:#04x}) are not decoded")]
    UnsupportedProduct {
        /// The last byte of the packet.
        id: u8,
        /// The name of the product.
        name: &'static str,
    },
    /// The return mode is unknown.
    #[error("the return mode {mode:#04x} is not known; state it where it is certain")]
    UnknownReturnMode {
        /// The last byte but one of the packet.
        mode: u8,
    },
    /// The packet is of another model than the ones before it, or than stated.
    #[error("a packet of the {found} among those of the {expected}")]
    OtherModel {
        /// The model that the decoder decodes.
        expected: Model,
        /// The model of the packet.
        found: Model,
    },
}
