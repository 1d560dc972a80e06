//! Accessors: typed arrays over the buffers, read with every bound checked.
//!
//! Whatever the component type, numbers become `f64`, which holds all of them; `min` and `max` are not looked at. What a
//! file may make us decode is limited by its size ([`Document::charge`]): an accessor without bytes, a mesh shown many
//! times or a morph target of a line of text would otherwise cost any amount of memory.

use std::cell::Cell;
use std::path::Path;

use serde_json::Value;

use super::buffers::{Buffer, buffers};
use super::json::{Object, checked_index};
use super::problem::{Datum, Problem, Within};
use super::view::{Component, Origin, View};

/// Numbers that may be decoded for each byte of the file and its buffers: a vertex of 12 bytes may be used 64 times.
const NUMBERS_PER_BYTE: u64 = 16;
/// Numbers that any file may ask for.
const FREE_NUMBERS: u64 = 1 << 16;

/// A document, its buffers, and what may still be decoded of them.
pub(super) struct Document<'a> {
    pub root: Object<'a>,
    buffers: Vec<Buffer<'a>>,
    left: Cell<u64>,
}

/// The decoded numbers of an accessor.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Values {
    pub component: Component,
    pub normalised: bool,
    /// Numbers of each element.
    pub width: usize,
    /// Element after element; normalised ones are fractions.
    pub numbers: Vec<f64>,
    /// Where they stand; unknown when they are in several places or in none.
    origin: Option<Origin>,
}

impl Values {
    /// The number of elements.
    pub(super) fn len(&self) -> usize {
        self.numbers.len() / self.width
    }

    /// The elements, which have this width.
    pub(super) fn elements<const N: usize>(&self) -> &[[f64; N]] {
        self.numbers.as_chunks().0
    }

    /// The number `at` of an element in its buffer, for errors.
    pub(super) fn datum(&self, element: usize, at: usize) -> Option<Datum> {
        self.origin.map(|origin| origin.datum(element, at))
    }
}

impl<'a> Document<'a> {
    /// The document `root` of a file of `n_bytes` at `path`, whose binary chunk is `binary`.
    pub(super) fn new(root: &'a Value, binary: Option<&'a [u8]>, n_bytes: usize, path: &Path) -> Result<Self, Problem> {
        let root = Object::of(root)?;
        let buffers = buffers(root, binary, path)?;
        let n_bytes = n_bytes as u64 + buffers.iter().map(|buffer| buffer.len() as u64).sum::<u64>();
        Ok(Document { root, buffers, left: Cell::new(FREE_NUMBERS + NUMBERS_PER_BYTE * n_bytes) })
    }

    /// Takes `n` numbers from what the file may ask for.
    pub(super) fn charge(&self, n: u64) -> Result<(), Problem> {
        let left = self.left.get().checked_sub(n).ok_or_else(|| {
            Problem::here(
                "more numbers than the size of the file justifies: a count is wrong, or many nodes repeat a mesh; save it \
                 anew, with its instances as meshes",
            )
        })?;
        self.left.set(left);
        Ok(())
    }

    /// The object `index` of the list `list` of the document.
    pub(super) fn listed(&self, list: &str, index: u64) -> Result<(usize, Object<'a>), Problem> {
        let values = self.root.list(list)?;
        let index = checked_index(index, values.len(), list)?;
        Ok((index, Object::of(&values[index]).at_root(|| format!("{list}[{index}]"))?))
    }

    /// The shape of an accessor: the number of its elements and its `type`.
    pub(super) fn shape(&self, index: u64) -> Result<(u64, &'a str), Problem> {
        let (index, object) = self.listed("accessors", index)?;
        let shape = || Ok((object.wanted("count")?, object.text("type")?.unwrap_or_default()));
        shape().at_root(|| format!("accessors[{index}]"))
    }

    /// The numbers of an accessor whose `type` is one of `kinds`.
    pub(super) fn values(&self, index: u64, kinds: &[&str]) -> Result<Values, Problem> {
        let (index, object) = self.listed("accessors", index)?;
        self.decoded(object, kinds).at_root(|| format!("accessors[{index}]"))
    }

    fn decoded(&self, accessor: Object<'a>, kinds: &[&str]) -> Result<Values, Problem> {
        let kind = accessor.text("type")?.unwrap_or_default();
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 0,
        };
        if width == 0 || !kinds.contains(&kind) {
            return Err(Problem::at("type", format!("{kind:?} where {} is expected", kinds.join(" or "))));
        }
        let component = component(accessor)?;
        let normalised = accessor.flag("normalized")? && component != Component::F32;
        let count = accessor.wanted("count")?;
        self.charge(count.saturating_mul(width as u64)).within(|| "count".into())?;
        let count = usize::try_from(count).map_err(|_| Problem::at("count", "more than memory can hold"))?;
        let (mut numbers, mut origin) = match accessor.whole("bufferView")? {
            None => (vec![0.0; count * width], None),
            Some(view) => {
                let view = self.view(view).within(|| "bufferView".into())?;
                let offset = accessor.whole("byteOffset")?.unwrap_or(0);
                let mut numbers = Vec::with_capacity(count * width);
                let origin = view.push_numbers(&mut numbers, component, width, count, offset)?;
                (numbers, Some(origin))
            }
        };
        if let Some(sparse) = accessor.object("sparse")? {
            self.replace(sparse, component, width, &mut numbers).within(|| "sparse".into())?;
            origin = None;
        }
        if normalised {
            let largest = component.largest();
            // The smallest signed integer lies beyond -1, which is where the format puts it.
            numbers.iter_mut().for_each(|number| *number = (*number / largest).max(-1.0));
        }
        Ok(Values { component, normalised, width, numbers, origin })
    }

    /// Replaces the elements that a sparse accessor lists.
    fn replace(&self, sparse: Object<'a>, value: Component, width: usize, numbers: &mut [f64]) -> Result<(), Problem> {
        let n_elements = numbers.len() / width;
        let count = sparse.wanted("count")?;
        let count = usize::try_from(count).ok().filter(|&count| count <= n_elements).ok_or_else(|| {
            Problem::at("count", format!("{count} elements are replaced, but the accessor has {n_elements}"))
        })?;
        let part = |key: &str, known: Option<Component>, width: usize| -> Result<(Vec<f64>, Origin), Problem> {
            let object = sparse.object(key)?.ok_or_else(|| Problem::at(key, "it is missing"))?;
            let read = || {
                let component = known.map_or_else(|| component(object), Ok)?;
                let view = self.view(object.wanted("bufferView")?).within(|| "bufferView".into())?;
                let offset = object.whole("byteOffset")?.unwrap_or(0);
                let mut numbers = Vec::with_capacity(count * width);
                let origin = view.push_numbers(&mut numbers, component, width, count, offset)?;
                Ok((numbers, origin))
            };
            read().within(|| key.to_owned())
        };
        let (places, origin) = part("indices", None, 1)?;
        let (values, _) = part("values", Some(value), width)?;
        let mut last = -1.0;
        for (at, (&place, element)) in places.iter().zip(values.chunks_exact(width)).enumerate() {
            // A fraction or a negative number, which only wrong component types give, is no index either.
            if place <= last || place.fract() != 0.0 || place >= n_elements as f64 {
                let problem = format!("{place} follows {last}; indices rise and are below the {n_elements} elements");
                return Err(Problem::at("indices", problem).with(Some(origin.datum(at, 0))));
            }
            last = place;
            let start = place as usize * width;
            numbers[start..start + width].copy_from_slice(element);
        }
        Ok(())
    }

    fn view(&self, index: u64) -> Result<View<'_>, Problem> {
        let (index, object) = self.listed("bufferViews", index)?;
        let view = || -> Result<View<'_>, Problem> {
            let (buffer, n_bytes) = (object.wanted("buffer")?, object.wanted("byteLength")?);
            let offset = object.whole("byteOffset")?.unwrap_or(0);
            let buffer = checked_index(buffer, self.buffers.len(), "buffers").within(|| "buffer".into())?;
            let all: &[u8] = &self.buffers[buffer];
            let range = usize::try_from(offset).ok().zip(usize::try_from(n_bytes).ok());
            let range = range.and_then(|(start, n)| Some((start, all.get(start..start.checked_add(n)?)?)));
            let (byte, bytes) = range.ok_or_else(|| {
                let n = all.len();
                let problem = format!("{n_bytes} bytes from byte {offset}, but buffers[{buffer}] has {n}");
                Problem::at("byteLength", problem)
            })?;
            let stride = object.whole("byteStride")?;
            Ok(View { bytes, start: Datum { buffer, byte }, stride })
        };
        view().at_root(|| format!("bufferViews[{index}]"))
    }
}

fn component(object: Object<'_>) -> Result<Component, Problem> {
    let code = object.wanted("componentType")?;
    Component::numbered(code)
        .ok_or_else(|| Problem::at("componentType", format!("{code} is none; 5120 to 5123, 5125 or 5126 are")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read(accessor: Value, view: Value, bytes: &[u8]) -> Result<Values, String> {
        let root = json!({"accessors": [accessor], "bufferViews": [view], "buffers": [{"byteLength": bytes.len()}]});
        let document = Document::new(&root, Some(bytes), 0, Path::new("a"));
        document.and_then(|document| document.values(0, &["SCALAR", "VEC3"])).map_err(|problem| problem.to_string())
    }

    fn numbers(accessor: Value, view: Value, bytes: &[u8]) -> Vec<f64> {
        read(accessor, view, bytes).expect("an accessor").numbers
    }

    #[test]
    fn every_component_type_is_read_with_offsets_and_strides() {
        let bytes = [0, 0, 1, 2, 3, 0, 0xFF, 0xFE, 0xFD, 0];
        let view = json!({"buffer": 0, "byteOffset": 1, "byteLength": 9, "byteStride": 4});
        let vector =
            |code: u32| json!({"bufferView": 0, "byteOffset": 1, "componentType": code, "count": 2, "type": "VEC3"});
        assert_eq!(numbers(vector(5121), view.clone(), &bytes), [1.0, 2.0, 3.0, 255.0, 254.0, 253.0]);
        assert_eq!(numbers(vector(5120), view.clone(), &bytes), [1.0, 2.0, 3.0, -1.0, -2.0, -3.0]);
        let whole = json!({"buffer": 0, "byteLength": 10});
        let scalar =
            |code: u32| json!({"bufferView": 0, "byteOffset": 2, "componentType": code, "count": 2, "type": "SCALAR"});
        assert_eq!(numbers(scalar(5122), whole.clone(), &bytes), [513.0, 3.0]);
        assert_eq!(numbers(scalar(5123), whole.clone(), &bytes), [513.0, 3.0]);
        assert_eq!(numbers(scalar(5125), whole.clone(), &bytes), [197_121.0, 16_645_887.0 + 255.0 * 0.0]);
        let real = 1.5f32.to_le_bytes();
        let one = json!({"bufferView": 0, "componentType": 5126, "count": 1, "type": "SCALAR"});
        assert_eq!(numbers(one, json!({"buffer": 0, "byteLength": 4, "byteStride": u64::MAX}), &real), [1.5]);
    }

    #[test]
    fn normalised_integers_are_fractions() {
        let accessor = |code: u32| json!({"bufferView": 0, "componentType": code, "count": 3, "type": "SCALAR", "normalized": true});
        let view = json!({"buffer": 0, "byteLength": 3});
        assert_eq!(numbers(accessor(5121), view.clone(), &[0, 255, 51]), [0.0, 1.0, 0.2]);
        assert_eq!(numbers(accessor(5120), view, &[0x80, 0x81, 127]), [-1.0, -1.0, 1.0]);
    }

    #[test]
    fn sparse_elements_replace_others_or_zeros() {
        let bytes = [7, 8, 9, 1, 2, 50, 60];
        let root = json!({
            "accessors": [
                {"bufferView": 0, "componentType": 5121, "count": 3, "type": "SCALAR", "sparse": {"count": 2,
                    "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 2}}},
                {"componentType": 5121, "count": 4, "type": "SCALAR", "sparse": {"count": 1,
                    "indices": {"bufferView": 1, "byteOffset": 1, "componentType": 5121}, "values": {"bufferView": 2}}},
            ],
            "bufferViews": [{"buffer": 0, "byteLength": 3}, {"buffer": 0, "byteOffset": 3, "byteLength": 2},
                {"buffer": 0, "byteOffset": 5, "byteLength": 2}],
            "buffers": [{"byteLength": 7}],
        });
        let document = Document::new(&root, Some(&bytes), 0, Path::new("a")).unwrap();
        assert_eq!(document.values(0, &["SCALAR"]).unwrap().numbers, [7.0, 50.0, 60.0]);
        assert_eq!(document.values(1, &["SCALAR"]).unwrap().numbers, [0.0, 0.0, 50.0, 0.0]);
    }

    #[test]
    fn errors_name_the_path() {
        let view = || json!({"buffer": 0, "byteLength": 8});
        let accessor = || json!({"bufferView": 0, "componentType": 5121, "count": 8, "type": "SCALAR"});
        type Spoil = fn(&mut Value, &mut Value);
        let spoilt: [(Spoil, &str); 14] = [
            (|a, _| a["count"] = json!(9), "accessors[0].byteOffset: 9 elements of 1 bytes"),
            (|a, _| a["byteOffset"] = json!(u64::MAX), "accessors[0].byteOffset: 8 elements"),
            (|a, _| a["count"] = json!(u64::MAX), "accessors[0].count: more numbers than the size"),
            (|a, _| a["count"] = json!(-1), "accessors[0].count: -1 where"),
            (|a, _| a["componentType"] = json!(5124), "accessors[0].componentType: 5124 is none"),
            (|a, _| a["type"] = json!("MAT4"), "accessors[0].type: \"MAT4\" where SCALAR or VEC3"),
            (|a, _| a["bufferView"] = json!(1), "accessors[0].bufferView: it names bufferViews[1], but there are 1"),
            (|_, v| v["buffer"] = json!(1), "bufferView: bufferViews[0].buffer: it names buffers[1]"),
            (|_, v| v["byteLength"] = json!(9), "bufferViews[0].byteLength: 9 bytes from byte 0, but buffers[0] has 8"),
            (|_, v| v["byteOffset"] = json!(u64::MAX), "bufferViews[0].byteLength: 8 bytes from byte"),
            (|_, v| v["byteStride"] = json!(0), "bufferView: its byteStride of 0 is less than the 1 bytes"),
            (|_, v| v["byteStride"] = json!(u64::MAX), "accessors[0].byteOffset: 8 elements of 1 bytes"),
            (|a, _| a["sparse"] = json!({"count": 9}), "accessors[0].sparse.count: 9 elements are replaced"),
            (
                |a, _| {
                    let part = json!({"bufferView": 0, "componentType": 5121});
                    a["sparse"] = json!({"count": 2, "indices": part, "values": part});
                },
                "accessors[0].sparse.indices: 0 follows 0",
            ),
        ];
        for (spoil, message) in spoilt {
            let (mut accessor, mut view) = (accessor(), view());
            spoil(&mut accessor, &mut view);
            let error = read(accessor, view, &[0; 8]).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
        assert!(read(accessor(), view(), &[0; 8]).is_ok());
    }
}
