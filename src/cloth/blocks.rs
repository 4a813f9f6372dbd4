//! The blocks of a tile, each planned when it is first looked at, and built once for all that look
//! the same, as long as there is room to keep them.

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Deref;
use std::rc::Rc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};

use super::block::{Block, Tally};
use super::digest::digest;
use super::layout::{Layout, Placed};
use crate::accel::bvh::Effort;
use crate::error::Result;
use crate::memory;

/// The number of a block's plan, and the height at which the plan's zero lies.
pub type PlanOf = (u32, f64);

/// Bytes of blocks that are kept: some thousand blocks, as many as repeating cloth is made of.
const KEPT: usize = 96 << 20;

/// No more blocks are kept once the process may not have so many bytes more: building and tracing need
/// some.
const SPARE: usize = 64 << 20;

/// Blocks of the largest tile of which each is expected to meet many rays.
const THOROUGH: usize = 4096;

/// Blocks that later ones are compared with. Where so many differ, few that come are the same.
const COMPARED: usize = 1 << 18;

/// What the tables take for each block of the tile.
const BYTES_PER_BLOCK: usize = size_of::<OnceLock<PlanOf>>() + size_of::<OnceLock<Box<Block>>>();

/// Blocks that a thread remembers of those that are not kept. What a ray meets next is mostly what it,
/// or the one before, has met.
const REMEMBERED: usize = 128;

/// Tells the blocks of one tile from those of another.
static NEXT_TILE: AtomicU64 = AtomicU64::new(0);

thread_local! {
    static RECENT: RefCell<HashMap<(u64, u32), Rc<Block>>> = RefCell::default();
}

/// A block, kept or only lent.
pub enum BlockRef<'a> {
    /// As long as the tile lives.
    Kept(&'a Block),
    /// As long as someone looks at it.
    Lent(Rc<Block>),
}

impl Deref for BlockRef<'_> {
    type Target = Block;

    #[inline(always)]
    fn deref(&self) -> &Block {
        match self {
            Self::Kept(block) => block,
            Self::Lent(block) => block,
        }
    }
}

/// The blocks of a tile. Each takes 40 bytes, and no time before it is looked at. What is built of them
/// takes some 10 000 bytes each, up to a limit, beyond which blocks are built anew when they are met
/// again.
#[derive(Debug)]
pub struct Blocks {
    tile: u64,
    /// Bytes of those kept, and at most before no more are.
    kept: Tally,
    pub(super) limit: usize,
    pub(super) layout: Layout,
    columns: usize,
    /// Of each block of the tile, row by row.
    plan_of: Vec<OnceLock<PlanOf>>,
    /// Plans are numbered by the first block found that has them.
    built: Vec<OnceLock<Box<Block>>>,
    numbers: Mutex<HashMap<u128, u32>>,
}

impl Blocks {
    /// Those of a layout; [`Error::OutOfMemory`] if there is no room for their tables.
    pub fn new(layout: Layout) -> Result<Self> {
        let [columns, rows] = layout.axes().map(|axis| axis.len());
        let count = columns.saturating_mul(rows);
        let [ends, picks] = layout.counts();
        let work = format!("rendering {picks} picks x {ends} ends");
        memory::claim(&work, count.saturating_mul(BYTES_PER_BLOCK).saturating_add(SPARE))?;
        Ok(Self {
            tile: NEXT_TILE.fetch_add(1, Ordering::Relaxed),
            kept: Tally::default(),
            limit: KEPT,
            layout,
            columns,
            plan_of: memory::table(&work, count, OnceLock::new)?,
            built: memory::table(&work, count, OnceLock::new)?,
            numbers: Mutex::default(),
        })
    }

    /// How many different ones there are.
    pub fn distinct(&self) -> usize {
        let is_first = |index: &usize| self.plan_of(*index).0 as usize == *index;
        (0..self.plan_of.len()).filter(is_first).count()
    }

    /// The plan of the block with this number in the tile.
    #[inline]
    pub fn plan_of(&self, index: usize) -> PlanOf {
        *self.plan_of[index].get_or_init(|| self.find_plan(index))
    }

    /// The block of a plan.
    #[inline]
    pub fn block(&self, plan: u32) -> BlockRef<'_> {
        match self.built[plan as usize].get() {
            Some(block) => BlockRef::Kept(block),
            None => self.built_now(plan),
        }
    }

    #[cold]
    fn built_now(&self, plan: u32) -> BlockRef<'_> {
        if self.kept.bytes() < self.limit && memory::has_room(SPARE) {
            let build = || Box::new(self.build(plan, self.kept.clone()));
            return BlockRef::Kept(self.built[plan as usize].get_or_init(build));
        }
        BlockRef::Lent(RECENT.with_borrow_mut(|recent| {
            if recent.len() >= REMEMBERED && !recent.contains_key(&(self.tile, plan)) {
                recent.clear();
            }
            let build = || Rc::new(self.build(plan, Tally::default()));
            recent.entry((self.tile, plan)).or_insert_with(build).clone()
        }))
    }

    fn build(&self, plan: u32, tally: Tally) -> Block {
        Block::new(&self.placed(plan as usize).plan, &self.layout.forms, self.effort(), tally)
    }

    /// That depends on the tile alone, so that no block does on what was met before it.
    fn effort(&self) -> Effort {
        if self.plan_of.len() <= THOROUGH { Effort::Thorough } else { Effort::Quick }
    }

    #[cold]
    fn find_plan(&self, index: usize) -> PlanOf {
        let Placed { key, height, .. } = self.placed(index);
        let mut numbers = self.numbers.lock().expect("no thread panics with the lock");
        let (own, key) = (index as u32, digest(&key));
        let number = if numbers.len() < COMPARED {
            *numbers.entry(key).or_insert(own)
        } else {
            numbers.get(&key).copied().unwrap_or(own)
        };
        (number, height)
    }

    fn placed(&self, index: usize) -> Placed {
        self.layout.block([index % self.columns, index / self.columns])
    }
}
