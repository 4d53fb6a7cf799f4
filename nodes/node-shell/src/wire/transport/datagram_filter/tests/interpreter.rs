//! The kernel's machine in a few lines.

use super::super::assembler::{Instruction, code};
use super::rules::Verdict;

/// Runs a program over a datagram, which the kernel shows with its UDP header.
pub(super) fn run(program: &[Instruction], datagram: &[u8]) -> Verdict {
    let packet = [vec![0xaa; 8], datagram.to_vec()].concat();
    match returned(program, &packet) {
        0 => Verdict::Refused,
        count => Verdict::Taken((count as usize).min(packet.len()) - 8),
    }
}

fn load(packet: &[u8], width: u16, at: u32) -> Option<u32> {
    let bytes = match width {
        code::WORD => 4,
        code::HALF => 2,
        code::BYTE => 1,
        other => panic!("width {other}"),
    };
    let at = at as usize;
    let field = packet.get(at..at + bytes)?;
    Some(field.iter().fold(0, |number, byte| number << 8 | u32::from(*byte)))
}

fn returned(program: &[Instruction], packet: &[u8]) -> u32 {
    let (mut a, mut x, mut scratch, mut next) = (0_u32, 0_u32, [0_u32; 16], 0);
    loop {
        let Instruction { code: whole, if_true, if_false, operand } = program[next];
        next += 1;
        match whole & 0x07 {
            code::LOAD => {
                a = match whole & 0xe0 {
                    code::MEMORY => scratch[operand as usize],
                    code::LENGTH => packet.len() as u32,
                    mode => {
                        let from = if mode == code::INDEXED { x } else { 0 };
                        let Some(value) = load(packet, whole & 0x18, from + operand) else {
                            return 0;
                        };
                        value
                    }
                }
            }
            code::LOAD_X if whole & 0xe0 == code::MEMORY => x = scratch[operand as usize],
            code::LOAD_X => x = operand,
            code::STORE => scratch[operand as usize] = a,
            code::STORE_X => scratch[operand as usize] = x,
            code::CALCULATE => {
                let by = if whole & code::BY_X == 0 { operand } else { x };
                a = match whole & 0xf0 {
                    code::ADD => a.wrapping_add(by),
                    code::SUBTRACT => a.wrapping_sub(by),
                    code::MULTIPLY => a.wrapping_mul(by),
                    code::AND => a & by,
                    code::SHIFT_RIGHT => a >> by,
                    other => panic!("calculation {other:#x}"),
                };
            }
            code::JUMP => {
                let by = if whole & code::BY_X == 0 { operand } else { x };
                let holds = match whole & 0xf0 {
                    code::ALWAYS => {
                        next += operand as usize;
                        continue;
                    }
                    code::EQUAL => a == by,
                    code::GREATER => a > by,
                    code::AT_LEAST => a >= by,
                    code::ANY_BIT => a & by != 0,
                    other => panic!("comparison {other:#x}"),
                };
                next += usize::from(if holds { if_true } else { if_false });
            }
            code::RETURN => return if whole & 0x18 == code::OF_A { a } else { operand },
            code::TRANSFER if whole & 0xf8 == code::X_TO_A => a = x,
            code::TRANSFER => x = a,
            other => panic!("class {other}"),
        }
    }
}
