//! RTPS messages made by hand.

/// The byte order of a submessage.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    fn half(self, number: u16) -> [u8; 2] {
        match self {
            Self::Little => number.to_le_bytes(),
            Self::Big => number.to_be_bytes(),
        }
    }

    fn word(self, number: u32) -> [u8; 4] {
        match self {
            Self::Little => number.to_le_bytes(),
            Self::Big => number.to_be_bytes(),
        }
    }

    /// A sequence number: the upper word first, whatever the order.
    fn number(self, number: i64) -> Vec<u8> {
        [self.word((number >> 32) as u32), self.word(number as u32)].concat()
    }
}

#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Submessage(Vec<u8>);

impl Submessage {
    fn new(order: Order, kind: u8, length: u16, body: &[Vec<u8>]) -> Self {
        let mut bytes = vec![kind, u8::from(order == Order::Little)];
        bytes.extend(order.half(length));
        bytes.extend(body.concat());
        Self(bytes)
    }

    pub(super) fn heartbeat(order: Order, first: i64, last: i64) -> Self {
        let body = [vec![0; 8], order.number(first), order.number(last), order.word(9).to_vec()];
        Self::new(order, 0x07, 28, &body)
    }

    /// The numbers from `first` to the one before `last`, and no more.
    pub(super) fn gap(order: Order, first: i64, last: i64) -> Self {
        let body = [vec![0; 8], order.number(first), order.number(last), vec![0; 4]];
        Self::new(order, 0x08, 28, &body)
    }

    /// From a writer to a reader of these kinds.
    pub(super) fn fragment(order: Order, [reader, writer]: [u8; 2], bytes: u32) -> Self {
        let body = [
            [vec![0, 0], order.half(28).to_vec()].concat(),
            vec![0, 0, 3, reader, 0, 0, 3, writer],
            order.number(1),
            order.word(1).to_vec(),
            [order.half(1), order.half(1_024)].concat(),
            order.word(bytes).to_vec(),
            vec![7; 8],
        ];
        Self::new(order, 0x16, 40, &body)
    }

    /// Asks for the fragment `base`.
    pub(super) fn nack_fragment(order: Order, base: u32) -> Self {
        let body = [
            vec![0; 8],
            order.number(1),
            order.word(base).to_vec(),
            order.word(1).to_vec(),
            vec![0x80; 8],
        ];
        Self::new(order, 0x12, 32, &body)
    }

    pub(super) fn info_ts(order: Order) -> Self {
        Self::new(order, 0x09, 8, &[vec![3; 8]])
    }

    pub(super) fn info_dst(order: Order) -> Self {
        Self::new(order, 0x0e, 12, &[vec![5; 12]])
    }

    /// One of length 0 that ends with its header.
    pub(super) fn empty(order: Order, kind: u32) -> Self {
        Self::new(order, kind as u8, 0, &[])
    }

    /// Data of length 0, which is the rest of the message.
    pub(super) fn data_to_the_end(order: Order) -> Self {
        Self::new(order, 0x15, 0, &[vec![1; 40]])
    }
}

/// A message of these submessages.
pub(super) fn rtps<'a>(submessages: impl IntoIterator<Item = &'a Submessage>) -> Vec<u8> {
    let mut message = b"RTPS\x02\x03\x01\x0f".to_vec();
    message.extend([4; 12]);
    for submessage in submessages {
        message.extend(&submessage.0);
    }
    message
}
