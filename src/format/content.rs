//! Whether two descriptions are of the same scene, wherever its files lie.

use std::io;

use super::SceneDesc;
use super::desc::Value;

impl SceneDesc {
    /// Hash of everything the description says, after substitution, and of the contents of the mesh and
    /// image files that it names, as 16 hexadecimal digits. Folders do not count: a scene that was moved
    /// with its files, or is named by another path, is the same.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn content_hash(&self) -> io::Result<String> {
        // FNV-1a, as in `hash`.
        let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
        let mut add = |bytes: &[u8]| {
            for byte in bytes.iter().chain(&[0]) {
                hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        for object in &self.objects {
            add(object.plugin.name.as_bytes());
            for p in &object.params {
                add(p.name.as_bytes());
                match &p.value {
                    Value::File(path) => {
                        // Its extension may say how it is read.
                        add(path.extension().unwrap_or_default().as_encoded_bytes());
                        add(&std::fs::read(path)?);
                    }
                    value => add(format!("{value:?}").as_bytes()),
                }
            }
            for c in &object.children {
                add(c.name.as_deref().unwrap_or_default().as_bytes());
                add(c.object.index().to_string().as_bytes());
            }
        }
        Ok(format!("{hash:016x}"))
    }
}
