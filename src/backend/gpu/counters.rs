//! What threads of the shaders do, counted while they do it, to check the [account](super::account) on paper.
//!
//! A pass over naga's form of the shader, before it is written as SPIR-V. Statements up to the next branch or loop run as
//! one; so each such segment is given one counter, and what its statements cost is known beforehand. Counted are sums,
//! differences, products, quotients and square roots of f32, each component by itself, and the bytes that each storage
//! buffer is asked for. Negations, comparisons, selections, absolutes, floors, whole numbers and uniforms cost nothing. A
//! function belongs to the stage (the file) that it stands in; those of `HELPERS` belong to whoever calls them.
//!
//! What is counted is what the shader says: a compiler may leave out what nobody uses, and caches answer most loads.

use super::account::{Costs, KERNELS, Kind, STAGES};
use super::shader::{self, Fault};
use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    AddressSpace, BinaryOperator, Block, Expression, Function, Handle, Literal, MathFunction, Module, Span,
    Statement, TypeInner,
};
use std::collections::HashMap;

/// Counters of a thread of stitches; as many as `COUNTERS` in `shaders/count.wgsl`.
pub const COUNTERS: usize = 256;
/// Counters of a thread of the other kernels; as many as in `shaders/count_kernel.wgsl`.
pub const KERNEL_COUNTERS: usize = 64;
/// Functions whose calls are counted: they begin with a segment.
pub const CALLS: [&str; 4] = ["run_solve", "assemble", "factorise", "solve_factors"];
/// Files and functions that are charged to who calls them: they have no branches.
const HELPERS: [&str; 8] =
    ["thread", "vector", "places", "stencil", "surface", "know_counts", "in_plane", "stepped"];
/// The shaders' files of the counters themselves.
const OWN_FILES: [&str; 2] = ["count", "count_kernel"];
/// The function that puts counters down when a thread of an entry point ends.
const PUT: &str = "put_counts";

/// Bytes that an atomic operation reads, and writes.
const ATOMIC: u64 = 4;

/// Statements that run as one, and what they cost once.
#[derive(Clone, Debug)]
pub struct Segment {
    /// The function that they stand in.
    pub function: String,
    /// What they cost.
    pub costs: Costs,
}

/// What a thread did.
#[derive(Clone, Debug, Default)]
pub struct Counted {
    /// By stage.
    pub costs: Costs,
    /// `[function][segment]` how often each segment ran that costs anything, in the order of the text; none of functions
    /// that always cost the same.
    pub runs: HashMap<String, Vec<u64>>,
}

impl Counted {
    /// How often a function was called that is one of [`CALLS`].
    pub fn calls(&self, function: &str) -> u64 {
        self.runs.get(function).map_or(0, |runs| runs[0])
    }
}

/// `[face]` what the threads did, from their counters as they lie in the buffer.
pub(super) fn read(segments: &[Segment], words: &[f32], counters: usize) -> Vec<Counted> {
    let of_face = |words: &[f32]| {
        let mut counted = Counted::default();
        for (segment, word) in segments.iter().zip(words) {
            let runs = u64::from(word.to_bits());
            counted.costs.add(&segment.costs, runs);
            counted.runs.entry(segment.function.clone()).or_default().push(runs);
        }
        counted
    };
    words.chunks_exact(counters).map(of_face).collect()
}

/// The segments of a shader's text, in the order of their counters.
pub fn segments(text: &str) -> Result<Vec<Segment>, Fault> {
    let (module, info) = shader::parse(text)?;
    Ok(insert(&module, &info)?.1)
}

/// The module with counters, if it has a place for them; else as it was.
pub(super) fn counting((module, info): (Module, ModuleInfo)) -> Result<(Module, ModuleInfo), Fault> {
    if place(&module).is_none() {
        return Ok((module, info));
    }
    let (module, _) = insert(&module, &info)?;
    let info = shader::checked(&module).map_err(|e| Fault(e.to_string()))?;
    Ok((module, info))
}

fn place(module: &Module) -> Option<Handle<naga::GlobalVariable>> {
    let named = |(_, v): &(_, &naga::GlobalVariable)| v.name.as_deref() == Some("counted");
    module.global_variables.iter().find(named).map(|(handle, _)| handle)
}

fn insert(module: &Module, info: &ModuleInfo) -> Result<(Module, Vec<Segment>), Fault> {
    let counted = place(module).ok_or_else(|| Fault("a shader without counters".into()))?;
    // Other files have functions of the same names.
    let ours = |(name, file): &(&str, &str)| {
        stage_of(name, file).is_some() || HELPERS.contains(file) || OWN_FILES.contains(file)
    };
    let files: HashMap<_, _> = shader::functions().filter(ours).collect();
    let put = module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(PUT)).map(|(handle, _)| handle);
    let mut pass = Pass { module, counted, segments: Vec::new(), of: HashMap::new() };
    let mut changed = module.clone();
    // A function stands behind those that it calls.
    for (handle, function) in module.functions.iter() {
        let name = function.name.as_deref().unwrap_or_default();
        let file = files.get(name).copied().unwrap_or(name);
        if OWN_FILES.contains(&file) {
            pass.of.insert(handle, Some(Flat::default()));
            continue;
        }
        let helps = HELPERS.contains(&name) || HELPERS.contains(&file);
        let stage = stage_of(name, file).filter(|_| !helps);
        if stage.is_none() && !helps {
            return Err(Fault(format!("'{name}' belongs to no stage")));
        }
        let text = Text { function, info: &info[handle], stage };
        let flat = pass.flat(&text, &function.body)?;
        if flat.is_none() {
            if helps {
                return Err(Fault(format!("'{name}' branches")));
            }
            pass.count(&text, changed.functions.get_mut(handle), None)?;
        }
        pass.of.insert(handle, flat);
    }
    for (i, entry) in module.entry_points.iter().enumerate() {
        let stage = files.get(entry.name.as_str()).and_then(|file| stage_of(&entry.name, file));
        let mut function = entry.function.clone();
        function.name = Some(entry.name.clone());
        let text = Text { function: &function, info: info.get_entry_point(i), stage };
        pass.count(&text, &mut changed.entry_points[i].function, put)?;
    }
    let room = if put.is_some() { KERNEL_COUNTERS } else { COUNTERS };
    if pass.segments.len() > room {
        return Err(Fault(format!("{} counters, room for {room}", pass.segments.len())));
    }
    Ok((changed, pass.segments))
}

/// The stage that a function belongs to: the kernel that it is, or else that of its file.
fn stage_of(name: &str, file: &str) -> Option<usize> {
    let file = if file == "select" { "choose" } else { file };
    let of = |name: &str| STAGES.iter().position(|s| *s == name);
    of(name).filter(|_| KERNELS.contains(&name)).or_else(|| of(file))
}

/// What statements cost: by stage, and for whoever calls them.
#[derive(Clone, Debug, Default)]
struct Flat {
    costs: Costs,
    callers: [u64; Kind::COUNT],
}

impl Flat {
    fn is_nothing(&self) -> bool {
        self.costs == Costs::default() && self.callers == [0; Kind::COUNT]
    }

    fn charge(&mut self, stage: Option<usize>, kind: Kind, n: u64) {
        match stage {
            Some(stage) => self.costs.0[stage][kind as usize] += n,
            None => self.callers[kind as usize] += n,
        }
    }

    /// Adds what a call costs in a function of that stage.
    fn call(&mut self, stage: Option<usize>, called: &Flat) {
        self.costs.add(&called.costs, 1);
        for kind in Kind::ALL {
            self.charge(stage, kind, called.callers[kind as usize]);
        }
    }
}

/// A function as it was.
struct Text<'a> {
    function: &'a Function,
    info: &'a FunctionInfo,
    stage: Option<usize>,
}

struct Pass<'a> {
    module: &'a Module,
    counted: Handle<naga::GlobalVariable>,
    segments: Vec<Segment>,
    /// What a call costs, where that is always the same; none of functions that have counters of their own.
    of: HashMap<Handle<Function>, Option<Flat>>,
}

impl Pass<'_> {
    /// What a block costs, if that is always the same: where nothing that costs anything stands in a branch or behind one
    /// that leaves.
    fn flat(&self, text: &Text, block: &Block) -> Result<Option<Flat>, Fault> {
        let (mut flat, mut leaving) = (Flat::default(), false);
        for statement in block {
            let mut blocks = Vec::new();
            match statement {
                Statement::If { accept, reject, .. } => blocks = vec![accept, reject],
                Statement::Loop { body, continuing, .. } => blocks = vec![body, continuing],
                Statement::Block(block) => blocks = vec![block],
                Statement::Switch { .. } => return Err(Fault("a switch is not known how to count".into())),
                _ => {
                    if !self.cost(text, statement, &mut flat)? {
                        return Ok(None);
                    }
                }
            }
            for block in blocks {
                // What `&&` and `||` come to: a branch that costs nothing, and from which the text goes on.
                leaving |= leaves(block);
                match self.flat(text, block)? {
                    Some(inner) if inner.is_nothing() => {}
                    _ => return Ok(None),
                }
            }
        }
        Ok((!leaving || flat.is_nothing()).then_some(flat))
    }

    /// Adds what a statement costs; says whether that is always the same.
    fn cost(&self, text: &Text, statement: &Statement, flat: &mut Flat) -> Result<bool, Fault> {
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    self.evaluate(text, handle, flat)?;
                }
            }
            Statement::Store { pointer, value } => self.access(text, *pointer, *value, true, flat)?,
            Statement::Call { function, .. } => match self.of.get(function) {
                Some(Some(called)) => flat.call(text.stage, called),
                _ => return Ok(false),
            },
            // A word of a buffer, read and written.
            Statement::Atomic { pointer, .. } => {
                for write in [false, true] {
                    self.touch(text, *pointer, ATOMIC, write, flat)?;
                }
            }
            Statement::Break | Statement::Continue | Statement::Return { .. } => {}
            other => return Err(Fault(format!("{other:?} is not known how to count"))),
        }
        Ok(true)
    }

    fn inner<'b>(&'b self, text: &Text<'b>, handle: Handle<Expression>) -> &'b TypeInner {
        text.info[handle].ty.inner_with(&self.module.types)
    }

    fn evaluate(&self, text: &Text, handle: Handle<Expression>, flat: &mut Flat) -> Result<(), Fault> {
        use BinaryOperator::{Add, Divide, Modulo, Multiply, Subtract};
        let inner = self.inner(text, handle);
        let float = inner.scalar_kind() == Some(naga::ScalarKind::Float);
        let components = match inner {
            TypeInner::Vector { size, .. } => *size as u64,
            _ => 1,
        };
        let operations = match &text.function.expressions[handle] {
            Expression::Load { pointer } => return self.access(text, *pointer, handle, false, flat),
            Expression::Binary { op: Add | Subtract | Multiply | Divide, .. } if float => components,
            Expression::Math { fun: MathFunction::Sqrt, .. } => components,
            Expression::Binary { op: Modulo, .. } if float => {
                return Err(Fault("a remainder of floats".into()));
            }
            Expression::Math { fun, .. }
                if float && !matches!(fun, MathFunction::Abs | MathFunction::Floor) =>
            {
                return Err(Fault(format!("{fun:?} is not known how to count")));
            }
            _ => 0,
        };
        if matches!(inner, TypeInner::Matrix { .. }) {
            return Err(Fault("a matrix is not known how to count".into()));
        }
        flat.charge(text.stage, Kind::Operations, operations);
        Ok(())
    }

    /// Adds what it costs to read or write where a pointer leads.
    fn access(
        &self,
        text: &Text,
        pointer: Handle<Expression>,
        value: Handle<Expression>,
        write: bool,
        flat: &mut Flat,
    ) -> Result<(), Fault> {
        let bytes = u64::from(self.inner(text, value).size(self.module.to_ctx()));
        self.touch(text, pointer, bytes, write, flat)
    }

    fn touch(
        &self,
        text: &Text,
        pointer: Handle<Expression>,
        bytes: u64,
        write: bool,
        flat: &mut Flat,
    ) -> Result<(), Fault> {
        let mut at = pointer;
        let variable = loop {
            match text.function.expressions[at] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => at = base,
                Expression::GlobalVariable(variable) => break Some(&self.module.global_variables[variable]),
                Expression::LocalVariable(_) => break None,
                _ => return Err(Fault("a pointer from who knows where".into())),
            }
        };
        match variable {
            Some(variable) if matches!(variable.space, AddressSpace::Storage { .. }) => {
                let name = variable.name.as_deref().unwrap_or_default();
                let kind = Kind::of(name, write).ok_or_else(|| Fault(format!("a buffer '{name}'")))?;
                flat.charge(text.stage, kind, bytes);
            }
            // Uniforms and what is a thread's own.
            _ => {}
        }
        Ok(())
    }

    /// Puts counters into a function, and before its ends a call that puts them down.
    fn count(
        &mut self,
        text: &Text,
        changed: &mut Function,
        put: Option<Handle<Function>>,
    ) -> Result<(), Fault> {
        let Some(stage) = text.stage else {
            return Err(Fault(format!("{:?} belongs to no stage", text.function.name)));
        };
        let body = std::mem::take(&mut changed.body);
        let counted = changed.expressions.append(Expression::GlobalVariable(self.counted), Span::UNDEFINED);
        let one = changed.expressions.append(Expression::Literal(Literal::U32(1)), Span::UNDEFINED);
        let begins = text.function.name.as_deref().is_some_and(|name| CALLS.contains(&name));
        // Entry points that call it take the thread and how many workgroups there are, in this order.
        let mut argument = |i| changed.expressions.append(Expression::FunctionArgument(i), Span::UNDEFINED);
        let put = put.map(|function| Statement::Call {
            function,
            arguments: vec![argument(0), argument(1)],
            result: None,
        });
        let text = Text { stage: Some(stage), ..*text };
        let mut segments = Segments { text, changed, counted, one, put, begins };
        segments.changed.body = self.block(&mut segments, body)?;
        Ok(())
    }

    fn block(&mut self, to: &mut Segments, block: Block) -> Result<Block, Fault> {
        let mut done = Block::new();
        let (mut segment, mut flat) = (Block::new(), Flat::default());
        for (statement, span) in block.span_into_iter() {
            let statement = match statement {
                Statement::If { condition, accept, reject } => {
                    self.close(to, &mut done, &mut segment, &mut flat);
                    let (accept, reject) = (self.block(to, accept)?, self.block(to, reject)?);
                    Statement::If { condition, accept, reject }
                }
                Statement::Loop { body, continuing, break_if } => {
                    self.close(to, &mut done, &mut segment, &mut flat);
                    let (body, continuing) = (self.block(to, body)?, self.block(to, continuing)?);
                    Statement::Loop { body, continuing, break_if }
                }
                Statement::Block(inner) => {
                    self.close(to, &mut done, &mut segment, &mut flat);
                    Statement::Block(self.block(to, inner)?)
                }
                other => {
                    self.cost(&to.text, &other, &mut flat)?;
                    if let (Statement::Return { .. }, Some(put)) = (&other, &to.put) {
                        segment.push(put.clone(), Span::UNDEFINED);
                    }
                    segment.push(other, span);
                    continue;
                }
            };
            done.push(statement, span);
        }
        self.close(to, &mut done, &mut segment, &mut flat);
        Ok(done)
    }

    /// Ends a segment: its counter, then its statements. One that costs nothing has none, unless it tells of a call.
    fn close(&mut self, to: &mut Segments, done: &mut Block, segment: &mut Block, flat: &mut Flat) {
        let flat = std::mem::take(flat);
        if to.begins || !flat.is_nothing() {
            to.add_one(done, self.segments.len() as u32);
            let function = to.text.function.name.clone().unwrap_or_default();
            self.segments.push(Segment { function, costs: flat.costs });
            to.begins = false;
        }
        done.append(segment);
    }
}

/// Whether a block may end before its text does.
fn leaves(block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::If { accept, reject, .. } => leaves(accept) || leaves(reject),
        Statement::Block(block) => leaves(block),
        Statement::Emit(_) | Statement::Store { .. } | Statement::Call { .. } => false,
        _ => true,
    })
}

/// The function that counters are put into.
struct Segments<'a, 'b> {
    text: Text<'a>,
    changed: &'b mut Function,
    counted: Handle<Expression>,
    one: Handle<Expression>,
    put: Option<Statement>,
    begins: bool,
}

impl Segments<'_, '_> {
    /// `counted[index] += 1u`.
    fn add_one(&mut self, to: &mut Block, index: u32) {
        let mut add = |e| self.changed.expressions.append(e, Span::UNDEFINED);
        let pointer = add(Expression::AccessIndex { base: self.counted, index });
        let before = add(Expression::Load { pointer });
        let value = add(Expression::Binary { op: BinaryOperator::Add, left: before, right: self.one });
        to.push(Statement::Emit(naga::Range::new_from_bounds(pointer, value)), Span::UNDEFINED);
        to.push(Statement::Store { pointer, value }, Span::UNDEFINED);
    }
}
