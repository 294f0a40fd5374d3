//! Shaders whose sums stay as they are written.
//!
//! WGSL leaves compilers free to fuse and reorder floating-point operations. SPIR-V's decoration `NoContraction` forbids
//! it, operation by operation, but WGSL has no word for it; so it is added to the compiled module.

/// Operations on floats that could be fused or reordered: negation, sum, difference, product, quotient, and products
/// with vectors.
const ARITHMETIC: [u32; 10] = [127, 129, 131, 133, 136, 142, 143, 144, 145, 148];
const OP_DECORATE: u32 = 71;
const NO_CONTRACTION: u32 = 42;
/// The module's header.
const HEADER: usize = 5;
/// The first instructions that may follow the decorations: types, constants and functions (OpTypeVoid..OpTypeForwardPointer,
/// constants, OpVariable, OpUndef, OpFunction).
fn ends_decorations(op: u32) -> bool {
    matches!(op, 19..=39 | 41..=52 | 54 | 59 | 1)
}

const OP_NAME: u32 = 5;
const OP_FUNCTION: u32 = 54;

/// Whether an instruction names something so.
fn names(instruction: &[u32], name: &str) -> bool {
    let bytes: Vec<u8> = instruction[2..].iter().flat_map(|word| word.to_le_bytes()).collect();
    bytes.split(|b| *b == 0).next() == Some(name.as_bytes())
}

/// Forbids fusing and reordering in a SPIR-V module, every operation of it but those of a function that is to be left
/// `free`; with a dash before its name, only those of that function. A module that cannot be read is returned as it was.
pub fn forbid_contraction(module: Vec<u32>, free: Option<&str>) -> Vec<u32> {
    let mut results = Vec::new();
    let (all, free) = match free.map(|f| (f.strip_prefix('-'), f)) {
        Some((Some(but), _)) => (true, Some(but)),
        Some((None, one)) => (false, Some(one)),
        None => (false, None),
    };
    let (mut found, mut is_free) = (None, all);
    let mut place = None;
    let mut at = HEADER;
    while at < module.len() {
        let (count, op) = ((module[at] >> 16) as usize, module[at] & 0xffff);
        if count == 0 || at + count > module.len() {
            return module;
        }
        if place.is_none() && ends_decorations(op) {
            place = Some(at);
        }
        match op {
            OP_NAME if free.is_some_and(|free| names(&module[at..at + count], free)) => {
                found = Some(module[at + 1]);
            }
            OP_FUNCTION if count > 2 => is_free = all != (found == Some(module[at + 2])),
            _ => {}
        }
        if ARITHMETIC.contains(&op) && count > 2 && !is_free {
            results.push(module[at + 2]);
        }
        at += count;
    }
    let Some(place) = place else { return module };
    let mut changed = Vec::with_capacity(module.len() + 3 * results.len());
    changed.extend_from_slice(&module[..place]);
    for result in results {
        changed.extend([3 << 16 | OP_DECORATE, result, NO_CONTRACTION]);
    }
    changed.extend_from_slice(&module[place..]);
    changed
}
