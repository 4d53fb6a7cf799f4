//! The filter's program: walks the submessages of an RTPS message (RTPS 2.5, section 9.4) and refuses what the DDS library
//! would take in without bound.

use super::assembler::{Assembler, AssemblyError, Instruction, Label, Scratch, Test};

/// The submessages that are refused.
pub(super) mod limits {
    /// A heartbeat or a gap may name a range of this many times 65,536 sequence numbers: RustDDS 0.15 lists each
    /// missing number of a heartbeat (8 bytes each) and each number of a gap (some 40 bytes). A writer that keeps the last
    /// message of each key names as many as it has sent since the oldest of them: a long life of
    /// endpoints that come and go is tens of thousands.
    pub(in super::super) const RANGE_UPPER_HALF: u32 = 15;

    /// A message in fragments has less than this many times 65,536 bytes, so 64 MiB: twice the receive buffer that is asked
    /// for. The library allocates what a fragment claims.
    pub(in super::super) const MESSAGE_UPPER_HALF: u32 = 0x400;

    /// The kind of an entity (RTPS 2.5, section 9.3.1.2) from which on it is one of discovery's own. Its messages are below
    /// 64 KiB: the announcement of an endpoint.
    pub(in super::super) const BUILTIN_KIND: u32 = 0xc0;
}

/// Kinds of submessages (RTPS 2.5, section 9.4.5.1.1).
pub(super) mod kind {
    pub(in super::super) const PAD: u32 = 0x01;
    pub(in super::super) const HEARTBEAT: u32 = 0x07;
    pub(in super::super) const GAP: u32 = 0x08;
    pub(in super::super) const INFO_TS: u32 = 0x09;
    pub(in super::super) const NACK_FRAG: u32 = 0x12;
    pub(in super::super) const DATA_FRAG: u32 = 0x16;
}

/// Where the fields are, from the start of the submessage's header. Those of heartbeat and gap coincide: the first
/// number and the last one, or the first that is not in the gap.
pub(super) mod offset {
    pub(in super::super) const RANGE_FIRST: u32 = 12;
    pub(in super::super) const RANGE_LAST: u32 = 20;
    pub(in super::super) const FRAGMENT_READER_KIND: u32 = 11;
    pub(in super::super) const FRAGMENT_WRITER_KIND: u32 = 15;
    pub(in super::super) const MESSAGE_BYTES: u32 = 32;
    pub(in super::super) const FRAGMENT_BASE: u32 = 20;
}

/// The kernel shows a datagram with its UDP header.
pub(super) const UDP_HEADER: u32 = 8;
/// The header of an RTPS message.
pub(super) const RTPS_HEADER: u32 = 20;
pub(super) const SUBMESSAGE_HEADER: u32 = 4;
pub(super) const RTPS: u32 = u32::from_be_bytes(*b"RTPS");

/// The flag that says that the submessage is little-endian, within the header's word.
const LITTLE_ENDIAN: u32 = 0x0001_0000;
const WHOLE: u32 = u32::MAX;
const NOTHING: u32 = 0;

/// The header of the submessage: kind, flags, length.
const HEADER: Scratch = Scratch(0);
/// Where the submessage begins.
const POSITION: Scratch = Scratch(1);
/// A number that is compared with another.
const NUMBER: Scratch = Scratch(2);

/// The program that walks up to `submessages` submessages; what a datagram has behind these is cut off. A peer that sends
/// reliably sends that again, from the first that is missing.
///
/// # Errors
/// When the program does not fit the kernel's machine.
pub(super) fn program(submessages: usize) -> Result<Vec<Instruction>, AssemblyError> {
    let mut to = Assembler::default();
    let is_rtps = to.label();
    to.load_word_at(UDP_HEADER);
    to.jump_if(Test::Equals(RTPS), is_rtps);
    to.take_bytes(NOTHING);
    to.place(is_rtps);
    to.set_x(UDP_HEADER + RTPS_HEADER);
    for _ in 0..submessages {
        submessage(&mut to);
    }
    let (ended, cut) = (to.label(), to.label());
    to.load_packet_length();
    to.jump_if(Test::EqualsX, ended);
    to.jump_if(Test::AtLeastX, cut);
    to.take_bytes(NOTHING);
    to.place(ended);
    to.take_bytes(WHOLE);
    to.place(cut);
    to.a_from_x();
    to.take_a_bytes();
    to.finish()
}

/// Where a submessage leads to.
#[derive(Clone, Copy)]
struct Exits {
    /// On to the next.
    next: Label,
    /// The datagram is taken.
    accept: Label,
    /// The datagram is refused.
    refuse: Label,
}

/// Judges the submessage at X and moves X to the next.
fn submessage(to: &mut Assembler) {
    let exits = Exits { next: to.label(), accept: to.label(), refuse: to.label() };
    let (range, fragment, request, advance) = (to.label(), to.label(), to.label(), to.label());
    to.load_packet_length();
    to.jump_if(Test::EqualsX, exits.accept);
    to.load_word_at_x(0);
    to.store(HEADER);
    to.store_x(POSITION);
    to.shift_right(24);
    to.jump_if(Test::Equals(kind::HEARTBEAT), range);
    to.jump_if(Test::Equals(kind::GAP), range);
    to.jump_if(Test::Equals(kind::DATA_FRAG), fragment);
    to.jump_if(Test::Equals(kind::NACK_FRAG), request);
    to.jump(advance);

    to.place(range);
    judge_range(to, advance, exits);
    to.place(fragment);
    judge_fragment(to, advance, exits);
    to.place(request);
    judge_request(to, advance, exits);

    to.place(advance);
    move_on(to, exits);
    to.place(exits.accept);
    to.take_bytes(WHOLE);
    to.place(exits.refuse);
    to.take_bytes(NOTHING);
    to.place(exits.next);
}

/// A heartbeat or a gap: both numbers have one upper word, which is no absurd one, and are not too far apart.
fn judge_range(to: &mut Assembler, advance: Label, exits: Exits) {
    let (same_word, little, compare, ordered) = (to.label(), to.label(), to.label(), to.label());
    to.load_word_at_x(offset::RANGE_FIRST);
    to.store(NUMBER);
    to.load_word_at_x(offset::RANGE_LAST);
    to.load_x(NUMBER);
    to.jump_if(Test::EqualsX, same_word);
    to.jump(exits.refuse);
    to.place(same_word);
    to.load(HEADER);
    to.jump_if(Test::AnyBit(LITTLE_ENDIAN), little);
    // The upper half of each lower word, and the highest byte of the upper word, which is none but in a negative number
    // or one beyond all counting.
    to.a_from_x();
    to.jump_if(Test::AnyBit(0xff00_0000), exits.refuse);
    to.load_x(POSITION);
    to.load_half_at_x(offset::RANGE_FIRST + 4);
    to.store(NUMBER);
    to.load_half_at_x(offset::RANGE_LAST + 4);
    to.jump(compare);
    to.place(little);
    to.a_from_x();
    to.jump_if(Test::AnyBit(0x0000_00ff), exits.refuse);
    to.load_x(POSITION);
    to.load_half_at_x(offset::RANGE_FIRST + 6);
    to.swap_half();
    to.store(NUMBER);
    to.load_half_at_x(offset::RANGE_LAST + 6);
    to.swap_half();
    to.place(compare);
    to.load_x(NUMBER);
    to.jump_if(Test::AtLeastX, ordered);
    // Nothing is in a range that ends before it begins.
    to.jump(advance);
    to.place(ordered);
    to.subtract_x();
    to.jump_if(Test::Above(limits::RANGE_UPPER_HALF), exits.refuse);
    to.jump(advance);
}

/// A fragment: its message is not larger than those of its kind are.
fn judge_fragment(to: &mut Assembler, advance: Label, exits: Exits) {
    let (little, compare) = (to.label(), to.label());
    to.load(HEADER);
    to.jump_if(Test::AnyBit(LITTLE_ENDIAN), little);
    to.load_half_at_x(offset::MESSAGE_BYTES);
    to.jump(compare);
    to.place(little);
    to.load_half_at_x(offset::MESSAGE_BYTES + 2);
    to.swap_half();
    to.place(compare);
    to.jump_if(Test::AtLeast(limits::MESSAGE_UPPER_HALF), exits.refuse);
    to.jump_if(Test::Equals(0), advance);
    to.load_byte_at_x(offset::FRAGMENT_READER_KIND);
    to.jump_if(Test::AtLeast(limits::BUILTIN_KIND), exits.refuse);
    to.load_byte_at_x(offset::FRAGMENT_WRITER_KIND);
    to.jump_if(Test::AtLeast(limits::BUILTIN_KIND), exits.refuse);
    to.jump(advance);
}

/// A request for fragments: the library keeps a bit for each up to the first one requested, and numbers begin at 1.
fn judge_request(to: &mut Assembler, advance: Label, exits: Exits) {
    let little = to.label();
    to.load_word_at_x(offset::FRAGMENT_BASE);
    to.jump_if(Test::Equals(0), exits.refuse);
    to.load(HEADER);
    to.jump_if(Test::AnyBit(LITTLE_ENDIAN), little);
    to.load_half_at_x(offset::FRAGMENT_BASE);
    to.jump_if(Test::Equals(0), advance);
    to.jump(exits.refuse);
    to.place(little);
    to.load_half_at_x(offset::FRAGMENT_BASE + 2);
    to.jump_if(Test::Equals(0), advance);
    to.jump(exits.refuse);
}

/// Moves X, which is POSITION, to the next submessage.
fn move_on(to: &mut Assembler, exits: Exits) {
    let (little, sum, to_the_end, is_empty) = (to.label(), to.label(), to.label(), to.label());
    to.load_x(POSITION);
    to.load(HEADER);
    to.jump_if(Test::AnyBit(LITTLE_ENDIAN), little);
    to.and(0xffff);
    to.jump(sum);
    to.place(little);
    to.and(0xffff);
    to.swap_half();
    to.place(sum);
    to.jump_if(Test::Equals(0), to_the_end);
    to.add_x();
    to.add(SUBMESSAGE_HEADER);
    to.x_from_a();
    to.jump(exits.next);
    // Without a length a submessage reaches to the end, but for those that may be empty (section 9.4.5.1.3).
    to.place(to_the_end);
    to.load(HEADER);
    to.shift_right(24);
    to.jump_if(Test::Equals(kind::PAD), is_empty);
    to.jump_if(Test::Equals(kind::INFO_TS), is_empty);
    to.jump(exits.accept);
    to.place(is_empty);
    to.a_from_x();
    to.add(SUBMESSAGE_HEADER);
    to.x_from_a();
    to.jump(exits.next);
}
