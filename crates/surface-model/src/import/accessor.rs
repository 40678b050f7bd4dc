use std::io;

use gltf::json;
use json::accessor::{ComponentType, IndexComponentType, Type};
use json::validation::Checked;

use super::uri;
use crate::import::settings::ImportFault;

/// Reads accessors of a glTF document, with every offset checked.
///
/// The gltf crate's own readers panic on a POSITION accessor that is not float, on sparse values
/// that run out, and on documents with indices out of range; this one returns the place of the
/// fault.
pub(super) struct Accessors<'a> {
    root: &'a json::Root,
    /// The GLB container's BIN chunk.
    blob: Option<Vec<u8>>,
    resolve: &'a dyn Fn(&str) -> io::Result<Vec<u8>>,
    /// Buffers read so far; only those needed by geometry are.
    buffers: Vec<Option<Vec<u8>>>,
}

/// Layout of equally spaced elements in a buffer.
#[derive(Clone, Copy)]
struct Layout {
    buffer: usize,
    start: usize,
    stride: usize,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(
        root: &'a json::Root,
        blob: Option<Vec<u8>>,
        resolve: &'a dyn Fn(&str) -> io::Result<Vec<u8>>,
    ) -> Self {
        Self { root, blob, resolve, buffers: vec![None; root.buffers.len()] }
    }

    /// Returns the points of a `VEC3` accessor of floats.
    pub(super) fn points(&mut self, accessor: usize) -> Result<Vec<[f32; 3]>, ImportFault> {
        let a = self.accessor(accessor)?;
        let kind = (a.type_, a.component_type.as_ref());
        let (Checked::Valid(Type::Vec3), Checked::Valid(component)) = kind else {
            return Err(fault("accessors", accessor, "positions must be of type VEC3"));
        };
        if component.0 != ComponentType::F32 {
            return Err(ImportFault::Unsupported {
                feature: format!("accessors[{accessor}]: positions that are not float (KHR_mesh_quantization)"),
                hint: "write the file without quantization",
            });
        }
        let data = self.elements(accessor, 12)?;
        Ok(data
            .as_chunks::<12>()
            .0
            .iter()
            .map(|e| [0, 4, 8].map(|k| f32::from_le_bytes([e[k], e[k + 1], e[k + 2], e[k + 3]])))
            .collect())
    }

    /// Returns the indices of a `SCALAR` accessor of unsigned bytes, shorts or ints.
    pub(super) fn indices(&mut self, accessor: usize) -> Result<Vec<u32>, ImportFault> {
        let a = self.accessor(accessor)?;
        let (Checked::Valid(Type::Scalar), Checked::Valid(component)) = (a.type_, a.component_type) else {
            return Err(fault("accessors", accessor, "indices must be of type SCALAR"));
        };
        if !matches!(component.0, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            return Err(fault("accessors", accessor, "indices must be unsigned bytes, shorts or ints"));
        }
        let size = component.0.size();
        Ok(self.elements(accessor, size)?.chunks_exact(size).map(unsigned).collect())
    }

    fn accessor(&self, accessor: usize) -> Result<&'a json::Accessor, ImportFault> {
        self.root.accessors.get(accessor).ok_or_else(|| fault("accessors", accessor, "it does not exist"))
    }

    /// Returns the bytes of all elements, one after the other, with sparse ones in place.
    fn elements(&mut self, accessor: usize, size: usize) -> Result<Vec<u8>, ImportFault> {
        let a = self.accessor(accessor)?;
        let Some(view) = a.buffer_view else {
            return Err(fault("accessors", accessor, "it has no buffer view, so its data is compressed or missing"));
        };
        let count = as_usize(a.count.0);
        let mut data = self.gather(view.value(), a.byte_offset.map_or(0, |o| o.0), count, size)?;
        if let Some(sparse) = &a.sparse {
            let n = as_usize(sparse.count.0);
            let Checked::Valid(IndexComponentType(component)) = sparse.indices.component_type else {
                return Err(fault("accessors", accessor, "its sparse indices are of no known type"));
            };
            let index_size = component.size();
            let places =
                self.gather(sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0, n, index_size)?;
            let values = self.gather(sparse.values.buffer_view.value(), sparse.values.byte_offset.0, n, size)?;
            for (place, value) in places.chunks_exact(index_size).zip(values.chunks_exact(size)) {
                let place = unsigned(place) as usize;
                if place >= count {
                    return Err(fault("accessors", accessor, "a sparse index is out of range"));
                }
                data[place * size..(place + 1) * size].copy_from_slice(value);
            }
        }
        Ok(data)
    }

    /// Copies `count` elements of `size` bytes out of a buffer view.
    fn gather(&mut self, view: usize, offset: u64, count: usize, size: usize) -> Result<Vec<u8>, ImportFault> {
        let layout = self.layout(view, offset, count, size)?;
        let buffer = self.buffer(layout.buffer)?;
        let outside = || fault("bufferViews", view, "it reaches beyond the end of its buffer");
        if count == 0 {
            return Ok(Vec::new());
        }
        // Checked as a whole before anything of that size is allocated.
        let last = (count - 1).checked_mul(layout.stride).and_then(|l| l.checked_add(layout.start));
        let end = last.and_then(|l| l.checked_add(size)).filter(|&end| end <= buffer.len()).ok_or_else(outside)?;
        let mut data = Vec::with_capacity(count * size);
        for element in buffer[layout.start..end].chunks(layout.stride) {
            data.extend_from_slice(&element[..size]);
        }
        Ok(data)
    }

    fn layout(&self, view: usize, offset: u64, count: usize, size: usize) -> Result<Layout, ImportFault> {
        let of_view = |message: &str| fault("bufferViews", view, message);
        let v = self.root.buffer_views.get(view).ok_or_else(|| of_view("it does not exist"))?;
        let stride = v.byte_stride.map_or(size, |s| s.0);
        // A smaller stride would let elements overlap, and a few bytes pass for any number of them.
        if stride < size {
            return Err(of_view("its stride is less than the size of an element"));
        }
        let offset = as_usize(offset);
        let end = count.saturating_sub(1).saturating_mul(stride).saturating_add(offset).saturating_add(size);
        if count > 0 && end > as_usize(v.byte_length.0) {
            return Err(of_view("it is shorter than the accessor that uses it"));
        }
        let start = as_usize(v.byte_offset.map_or(0, |o| o.0)).saturating_add(offset);
        Ok(Layout { buffer: v.buffer.value(), start, stride })
    }

    fn buffer(&mut self, buffer: usize) -> Result<&[u8], ImportFault> {
        let slot = self.buffers.get(buffer).ok_or_else(|| fault("buffers", buffer, "it does not exist"))?;
        if slot.is_none() {
            let data = self.load(buffer)?;
            self.buffers[buffer] = Some(data);
        }
        Ok(self.buffers[buffer].as_deref().unwrap_or_default())
    }

    fn load(&mut self, buffer: usize) -> Result<Vec<u8>, ImportFault> {
        let b = &self.root.buffers[buffer];
        let mut data = match b.uri.as_deref() {
            None if buffer == 0 => {
                self.blob.take().ok_or_else(|| fault("buffers", buffer, "it has no data: there is no BIN chunk"))?
            }
            None => return Err(fault("buffers", buffer, "it has no data, so it is a stand-in for compressed data")),
            Some(address) => match uri::embedded(address) {
                Some(data) => {
                    data.map_err(|e| fault("buffers", buffer, &format!("its data cannot be decoded: {e}")))?
                }
                None => {
                    let uri = uri::percent_decoded(address);
                    (self.resolve)(&uri).map_err(|source| ImportFault::External { uri, source })?
                }
            },
        };
        let length = as_usize(b.byte_length.0);
        if data.len() < length {
            let message = format!("it is to hold {length} bytes, but there are only {}", data.len());
            return Err(fault("buffers", buffer, &message));
        }
        data.truncate(length);
        Ok(data)
    }
}

pub(super) fn fault(list: &str, index: usize, message: &str) -> ImportFault {
    ImportFault::Element { element: format!("{list}[{index}]"), message: message.to_owned() }
}

/// Saturates on machines with smaller integers; no buffer is that long.
fn as_usize(n: u64) -> usize {
    usize::try_from(n).unwrap_or(usize::MAX)
}

/// Returns an unsigned little-endian number of one to four bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |n, &b| n << 8 | u32::from(b))
}
