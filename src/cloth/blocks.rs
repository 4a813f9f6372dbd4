//! The blocks of a tile, each planned when it is first looked at, and built once for all that look
//! the same, as long as there is room to keep them.

use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Deref;
use std::rc::Rc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};

use super::block::Block;
use super::layout::{Layout, Placed};

/// The number of a block's plan, and the height at which the plan's zero lies.
pub type PlanOf = (u32, f64);

/// Bytes of blocks that are kept: for each block of the tile, and at least.
const KEPT_PER_BLOCK: usize = 600;
const KEPT_AT_LEAST: usize = 256 << 20;

/// Blocks that a thread remembers of those that are not kept. What a ray meets next is mostly what it,
/// or the one before, has met.
const REMEMBERED: usize = 256;

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

/// The blocks of a tile. What is never looked at takes 40 bytes a block and no time; what is looked at
/// some thousand bytes, up to a limit, beyond which blocks are built anew when they are met again.
#[derive(Debug)]
pub struct Blocks {
    tile: u64,
    /// Bytes of those built, and at most before no more are kept.
    kept: AtomicUsize,
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
    /// Those of a layout.
    pub fn new(layout: Layout) -> Self {
        let [columns, rows] = layout.axes().map(|axis| axis.len());
        Self {
            tile: NEXT_TILE.fetch_add(1, Ordering::Relaxed),
            kept: AtomicUsize::new(0),
            limit: KEPT_AT_LEAST.max(KEPT_PER_BLOCK * columns * rows),
            layout,
            columns,
            plan_of: (0..columns * rows).map(|_| OnceLock::new()).collect(),
            built: (0..columns * rows).map(|_| OnceLock::new()).collect(),
            numbers: Mutex::default(),
        }
    }

    /// How many different ones there are.
    pub fn distinct(&self) -> usize {
        for index in 0..self.plan_of.len() {
            self.plan_of(index);
        }
        self.numbers.lock().expect("no thread panics with the lock").len()
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
        if self.kept.load(Ordering::Relaxed) < self.limit {
            return BlockRef::Kept(self.built[plan as usize].get_or_init(|| {
                let block = Box::new(self.build(plan));
                self.kept.fetch_add(block.bytes(), Ordering::Relaxed);
                block
            }));
        }
        BlockRef::Lent(RECENT.with_borrow_mut(|recent| {
            if recent.len() >= REMEMBERED && !recent.contains_key(&(self.tile, plan)) {
                recent.clear();
            }
            recent.entry((self.tile, plan)).or_insert_with(|| Rc::new(self.build(plan))).clone()
        }))
    }

    fn build(&self, plan: u32) -> Block {
        Block::new(&self.placed(plan as usize).plan, &self.layout.forms)
    }

    #[cold]
    fn find_plan(&self, index: usize) -> PlanOf {
        let Placed { key, height, .. } = self.placed(index);
        let mut numbers = self.numbers.lock().expect("no thread panics with the lock");
        (*numbers.entry(digest(&key)).or_insert(index as u32), height)
    }

    fn placed(&self, index: usize) -> Placed {
        self.layout.block([index % self.columns, index / self.columns])
    }
}

/// 128 bits that stand for a key: no two of the keys that fit in memory are likely to share them.
fn digest(key: &[i64]) -> u128 {
    let [high, low] = [0, 1].map(|half: u64| {
        let mut hasher = DefaultHasher::new();
        (half, key).hash(&mut hasher);
        u128::from(hasher.finish())
    });
    high << 64 | low
}
