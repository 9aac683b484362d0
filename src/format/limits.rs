//! What a scene file may ask for at most, so that no input exhausts memory or the stack.

/// Bytes of one XML file.
pub const XML_FILE_BYTES: u64 = 64 << 20;
/// Bytes of all XML files of one scene together, each counted as often as it is included.
pub const XML_TOTAL_BYTES: u64 = 256 << 20;
/// Elements, texts and comments of one XML file.
pub const XML_NODES: u32 = 4_000_000;
/// Depth of elements inside elements.
pub const XML_NESTING: usize = 64;
/// Depth of files including files.
pub const INCLUDE_DEPTH: usize = 15;
/// Includes of one scene, counting each time.
pub const INCLUDES: usize = 10_000;
/// Bytes that `$name` may be replaced by, over the whole scene.
pub const FILLED_IN_BYTES: usize = 64 << 20;
/// Side of an image.
pub const IMAGE_SIDE: i64 = 65_536;
/// Bytes of one mesh file.
pub const MESH_FILE_BYTES: u64 = 8 << 30;
/// Corners of one polygon.
pub const POLYGON_CORNERS: usize = 1 << 16;
