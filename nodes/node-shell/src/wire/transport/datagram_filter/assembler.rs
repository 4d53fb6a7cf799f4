//! Assembles programs of the kernel's classic packet filter (BPF; Linux `Documentation/networking/filter.rst`).
//!
//! The machine has an accumulator A, an index X, sixteen words of scratch memory, and jumps that lead forward only. A load
//! beyond the packet's end refuses the packet.

/// One instruction, as the kernel takes it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in super::super) struct Instruction {
    pub(in super::super) code: u16,
    /// How many instructions to skip when a comparison holds.
    pub(in super::super) if_true: u8,
    /// How many to skip when it does not.
    pub(in super::super) if_false: u8,
    pub(in super::super) operand: u32,
}

/// The parts that an instruction's code is the sum of.
pub(super) mod code {
    pub(in super::super) const LOAD: u16 = 0x00;
    pub(in super::super) const LOAD_X: u16 = 0x01;
    pub(in super::super) const STORE: u16 = 0x02;
    pub(in super::super) const STORE_X: u16 = 0x03;
    pub(in super::super) const CALCULATE: u16 = 0x04;
    pub(in super::super) const JUMP: u16 = 0x05;
    pub(in super::super) const RETURN: u16 = 0x06;
    pub(in super::super) const TRANSFER: u16 = 0x07;

    pub(in super::super) const WORD: u16 = 0x00;
    pub(in super::super) const HALF: u16 = 0x08;
    pub(in super::super) const BYTE: u16 = 0x10;

    pub(in super::super) const IMMEDIATE: u16 = 0x00;
    pub(in super::super) const ABSOLUTE: u16 = 0x20;
    pub(in super::super) const INDEXED: u16 = 0x40;
    pub(in super::super) const MEMORY: u16 = 0x60;
    pub(in super::super) const LENGTH: u16 = 0x80;

    pub(in super::super) const ADD: u16 = 0x00;
    pub(in super::super) const SUBTRACT: u16 = 0x10;
    pub(in super::super) const MULTIPLY: u16 = 0x20;
    pub(in super::super) const AND: u16 = 0x50;
    pub(in super::super) const SHIFT_RIGHT: u16 = 0x70;

    pub(in super::super) const ALWAYS: u16 = 0x00;
    pub(in super::super) const EQUAL: u16 = 0x10;
    pub(in super::super) const GREATER: u16 = 0x20;
    pub(in super::super) const AT_LEAST: u16 = 0x30;
    pub(in super::super) const ANY_BIT: u16 = 0x40;

    pub(in super::super) const OF_X: u16 = 0x08;
    /// The second operand of a jump or a calculation is X.
    pub(in super::super) const BY_X: u16 = 0x08;
    /// Returns A.
    pub(in super::super) const OF_A: u16 = 0x10;
    pub(in super::super) const A_TO_X: u16 = 0x00;
    pub(in super::super) const X_TO_A: u16 = 0x80;
}

/// A place in the program that jumps lead to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Label(usize);

/// The operand that a jump compares A with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Test {
    Equals(u32),
    EqualsX,
    Above(u32),
    AtLeast(u32),
    AtLeastX,
    /// One of these bits is set.
    AnyBit(u32),
}

/// A number of scratch memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Scratch(pub(super) u32);

/// The program does not fit the machine.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub(super) enum AssemblyError {
    #[error("a jump at instruction {from} leads {over:?} instructions ahead")]
    Reach { from: usize, over: Option<usize> },
    #[error("the label {0} is nowhere")]
    Unplaced(usize),
}

/// A program in the making.
#[derive(Default)]
pub(super) struct Assembler {
    instructions: Vec<Instruction>,
    /// Jumps whose distance is not known yet.
    jumps: Vec<(usize, Label)>,
    /// Where each label is.
    labels: Vec<Option<usize>>,
}

impl Assembler {
    pub(super) fn label(&mut self) -> Label {
        self.labels.push(None);
        Label(self.labels.len() - 1)
    }

    /// Places a label before the next instruction.
    pub(super) fn place(&mut self, label: Label) {
        if let Some(place) = self.labels.get_mut(label.0) {
            *place = Some(self.instructions.len());
        }
    }

    fn push(&mut self, code: u16, operand: u32) {
        self.instructions.push(Instruction { code, if_true: 0, if_false: 0, operand });
    }

    pub(super) fn load_word_at(&mut self, offset: u32) {
        self.push(code::LOAD | code::WORD | code::ABSOLUTE, offset);
    }

    pub(super) fn load_word_at_x(&mut self, offset: u32) {
        self.push(code::LOAD | code::WORD | code::INDEXED, offset);
    }

    pub(super) fn load_half_at_x(&mut self, offset: u32) {
        self.push(code::LOAD | code::HALF | code::INDEXED, offset);
    }

    pub(super) fn load_byte_at_x(&mut self, offset: u32) {
        self.push(code::LOAD | code::BYTE | code::INDEXED, offset);
    }

    pub(super) fn load_packet_length(&mut self) {
        self.push(code::LOAD | code::WORD | code::LENGTH, 0);
    }

    pub(super) fn load(&mut self, from: Scratch) {
        self.push(code::LOAD | code::MEMORY, from.0);
    }

    pub(super) fn load_x(&mut self, from: Scratch) {
        self.push(code::LOAD_X | code::MEMORY, from.0);
    }

    pub(super) fn set_x(&mut self, value: u32) {
        self.push(code::LOAD_X | code::IMMEDIATE, value);
    }

    pub(super) fn store(&mut self, to: Scratch) {
        self.push(code::STORE, to.0);
    }

    pub(super) fn store_x(&mut self, to: Scratch) {
        self.push(code::STORE_X, to.0);
    }

    pub(super) fn add(&mut self, value: u32) {
        self.push(code::CALCULATE | code::ADD, value);
    }

    pub(super) fn add_x(&mut self) {
        self.push(code::CALCULATE | code::ADD | code::OF_X, 0);
    }

    pub(super) fn subtract_x(&mut self) {
        self.push(code::CALCULATE | code::SUBTRACT | code::OF_X, 0);
    }

    pub(super) fn and(&mut self, mask: u32) {
        self.push(code::CALCULATE | code::AND, mask);
    }

    pub(super) fn shift_right(&mut self, bits: u32) {
        self.push(code::CALCULATE | code::SHIFT_RIGHT, bits);
    }

    /// Exchanges the two bytes of the half word in A.
    pub(super) fn swap_half(&mut self) {
        self.push(code::CALCULATE | code::MULTIPLY, 0x0001_0001);
        self.shift_right(8);
        self.and(0xffff);
    }

    pub(super) fn x_from_a(&mut self) {
        self.push(code::TRANSFER | code::A_TO_X, 0);
    }

    pub(super) fn a_from_x(&mut self) {
        self.push(code::TRANSFER | code::X_TO_A, 0);
    }

    /// Takes as many bytes of the packet as A says; none refuses it.
    pub(super) fn take_a_bytes(&mut self) {
        self.push(code::RETURN | code::OF_A, 0);
    }

    /// Takes this many bytes of the packet; none refuses it.
    pub(super) fn take_bytes(&mut self, count: u32) {
        self.push(code::RETURN, count);
    }

    pub(super) fn jump(&mut self, to: Label) {
        self.jumps.push((self.instructions.len(), to));
        self.push(code::JUMP | code::ALWAYS, 0);
    }

    /// Jumps where the test holds of A, and goes on otherwise.
    pub(super) fn jump_if(&mut self, test: Test, to: Label) {
        self.jumps.push((self.instructions.len(), to));
        let (comparison, operand) = match test {
            Test::Equals(value) => (code::EQUAL, value),
            Test::EqualsX => (code::EQUAL | code::BY_X, 0),
            Test::Above(value) => (code::GREATER, value),
            Test::AtLeast(value) => (code::AT_LEAST, value),
            Test::AtLeastX => (code::AT_LEAST | code::BY_X, 0),
            Test::AnyBit(mask) => (code::ANY_BIT, mask),
        };
        self.push(code::JUMP | comparison, operand);
    }

    /// The program.
    ///
    /// # Errors
    /// When a jump leads backward, further than the machine can jump, or nowhere.
    pub(super) fn finish(mut self) -> Result<Vec<Instruction>, AssemblyError> {
        for (from, label) in self.jumps {
            let place = self.labels.get(label.0).copied().flatten();
            let place = place.ok_or(AssemblyError::Unplaced(label.0))?;
            let over = place.checked_sub(from + 1);
            let reach = AssemblyError::Reach { from, over };
            let over = over.ok_or(reach)?;
            let Some(instruction) = self.instructions.get_mut(from) else { continue };
            if instruction.code == code::JUMP | code::ALWAYS {
                instruction.operand = u32::try_from(over).map_err(|_| reach)?;
            } else {
                instruction.if_true = u8::try_from(over).map_err(|_| reach)?;
            }
        }
        Ok(self.instructions)
    }
}
