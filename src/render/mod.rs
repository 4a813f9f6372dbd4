//! From scene to picture: cameras, lights, the path tracer and what drives it.

mod aim;
pub mod camera;
pub mod cells;
pub mod driver;
pub mod light;
pub mod path;
pub mod pixel;
pub mod recorder;
pub mod scene;
pub mod tape;
