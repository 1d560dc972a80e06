//! Where the numbers of a glTF document are: in the binary chunk, in the document itself as base64, or in other files.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::json::Object;
use super::problem::{Problem, Within};

/// Decodes base64 whether it is padded or not, as programs write both.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes of one buffer.
pub(super) type Buffer<'a> = Rc<Cow<'a, [u8]>>;

/// The buffers of the document: `binary` is the chunk of a `.glb` file, `path` the document's file.
pub(super) fn buffers<'a>(root: Object<'_>, binary: Option<&'a [u8]>, path: &Path) -> Result<Vec<Buffer<'a>>, Problem> {
    let mut files: BTreeMap<PathBuf, Buffer<'a>> = BTreeMap::new();
    let list = root.list("buffers")?;
    let mut buffers = Vec::with_capacity(list.len());
    for (index, value) in list.iter().enumerate() {
        let mut buffer = || -> Result<Buffer<'a>, Problem> {
            let object = Object::of(value)?;
            let n_bytes = object.wanted("byteLength")?;
            let bytes: Buffer<'a> = match object.text("uri")? {
                Some(uri) => match data_of(uri).within(|| "uri".into())? {
                    Some(bytes) => Rc::new(bytes.into()),
                    None => {
                        let file = beside(path, uri).within(|| "uri".into())?;
                        match files.get(&file) {
                            Some(bytes) if bytes.len() as u64 >= n_bytes => Rc::clone(bytes),
                            _ => {
                                let bytes: Buffer<'a> = Rc::new(head(&file, n_bytes).within(|| "uri".into())?.into());
                                files.insert(file, Rc::clone(&bytes));
                                bytes
                            }
                        }
                    }
                },
                None => match binary.filter(|_| index == 0) {
                    Some(chunk) => Rc::new(chunk.into()),
                    None => {
                        let problem = "it is missing, and the file has no binary chunk for this buffer";
                        return Err(Problem::at("uri", problem));
                    }
                },
            };
            if (bytes.len() as u64) < n_bytes {
                let n = bytes.len();
                let problem = format!("{n_bytes} bytes, but there are {n}: the buffer is truncated");
                return Err(Problem::at("byteLength", problem));
            }
            Ok(bytes)
        };
        buffers.push(buffer().within(|| format!("buffers[{index}]"))?);
    }
    Ok(buffers)
}

/// The bytes within a data URI, or `None` when it is no data URI.
fn data_of(uri: &str) -> Result<Option<Vec<u8>>, Problem> {
    let Some(rest) = uri.get(..5).filter(|scheme| scheme.eq_ignore_ascii_case("data:")).map(|_| &uri[5..]) else {
        return Ok(None);
    };
    let Some((kind, data)) = rest.split_once(',') else {
        return Err(Problem::here("a data URI without a comma in front of the data"));
    };
    if !kind.ends_with(";base64") {
        return Err(Problem::here("a data URI that is not base64: save the buffer as base64 or as a file"));
    }
    let wrong = |error| Problem::here(format!("the base64 of the data URI is wrong: {error}"));
    BASE64.decode(data).map(Some).map_err(wrong)
}

/// The file that a relative URI names, in the folder of the document or below it.
fn beside(document: &Path, uri: &str) -> Result<PathBuf, Problem> {
    let shown: String = uri.chars().take(80).collect();
    let refused =
        || Problem::here(format!("{shown:?} is no plain path inside the document's folder: copy the file there"));
    let relative = percent_decoded(uri).ok_or_else(refused)?;
    let mut path = document.parent().unwrap_or(Path::new("")).to_owned();
    // A colon begins another scheme or names a drive; a backslash separates folders on some systems alone.
    if relative.contains([':', '\\', '\0']) {
        return Err(refused());
    }
    let mut n_names = 0;
    for component in Path::new(&relative).components() {
        match component {
            Component::Normal(name) => {
                path.push(name);
                n_names += 1;
            }
            Component::CurDir => {}
            _ => return Err(refused()),
        }
    }
    if n_names == 0 { Err(refused()) } else { Ok(path) }
}

/// The first `n_bytes` of a file, which must have them.
fn head(file: &Path, n_bytes: u64) -> Result<Vec<u8>, Problem> {
    let unreadable = |error: &dyn std::fmt::Display| {
        Problem::here(format!("{} cannot be read: {error}; copy it beside the document", file.display()))
    };
    let metadata = std::fs::metadata(file).map_err(|error| unreadable(&error))?;
    if !metadata.is_file() {
        return Err(unreadable(&"it is no regular file"));
    }
    if metadata.len() < n_bytes {
        let n = metadata.len();
        let problem = format!("{} has {n} bytes; the document asks for {n_bytes}", file.display());
        return Err(Problem::here(problem));
    }
    let mut bytes = Vec::new();
    let open = std::fs::File::open(file).map_err(|error| unreadable(&error))?;
    open.take(n_bytes).read_to_end(&mut bytes).map_err(|error| unreadable(&error))?;
    Ok(bytes)
}

/// The URI with its `%20` and the like replaced; `None` when they are wrong or no UTF-8.
fn percent_decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let (digits, tail) = tail.split_at_checked(2)?;
        let [high, low] = [digits[0], digits[1]].map(|digit| (digit as char).to_digit(16));
        bytes.push((high? * 16 + low?) as u8);
        rest = tail;
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn loaded(list: Value, binary: Option<&[u8]>, path: &Path) -> Result<Vec<Vec<u8>>, String> {
        let root = json!({ "buffers": list });
        let buffers = buffers(Object::of(&root).unwrap(), binary, path).map_err(|problem| problem.to_string())?;
        Ok(buffers.iter().map(|buffer| buffer.to_vec()).collect())
    }

    #[test]
    fn bytes_come_from_chunk_text_and_file() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("a b")).unwrap();
        std::fs::write(folder.path().join("a b/c.bin"), b"12345").unwrap();
        let list = json!([
            {"byteLength": 2},
            {"byteLength": 3, "uri": "data:application/octet-stream;base64,AQID"},
            {"byteLength": 1, "uri": "data:;base64,AQ"},
            {"byteLength": 4, "uri": "./a%20b/c.bin"},
            {"byteLength": 5, "uri": "a b/c.bin"},
        ]);
        let found = loaded(list, Some(b"xy"), &folder.path().join("d.gltf")).unwrap();
        assert_eq!(found, [&b"xy"[..], &[1, 2, 3], &[1], b"1234", b"12345"]);
    }

    #[test]
    fn errors_name_the_buffer_and_the_remedy() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("c.bin"), b"12345").unwrap();
        let path = folder.path().join("d.gltf");
        for (buffer, message) in [
            (json!(1), "buffers[0]: 1 where an object is expected"),
            (json!({}), "buffers[0].byteLength: it is missing"),
            (json!({"byteLength": 1}), "buffers[0].uri: it is missing, and the file has no binary chunk"),
            (json!({"byteLength": 9, "uri": "data:;base64,AQID"}), "buffers[0].byteLength: 9 bytes, but there are 3"),
            (
                json!({"byteLength": 9, "uri": "data:;base64,A*ID"}),
                "buffers[0].uri: the base64 of the data URI is wrong",
            ),
            (json!({"byteLength": 9, "uri": "data:text,abc"}), "buffers[0].uri: a data URI that is not base64"),
            (json!({"byteLength": 9, "uri": "data:text"}), "buffers[0].uri: a data URI without a comma"),
            (json!({"byteLength": 9, "uri": "c.bin"}), "has 5 bytes; the document asks for 9"),
            (json!({"byteLength": 9, "uri": "e.bin"}), "cannot be read"),
            (json!({"byteLength": 0, "uri": "../d.gltf"}), "is no plain path inside the document's folder"),
            (json!({"byteLength": 0, "uri": "/etc/passwd"}), "is no plain path"),
            (json!({"byteLength": 0, "uri": "a/%2E%2E/b"}), "is no plain path"),
            (json!({"byteLength": 0, "uri": "http://a.b/c"}), "is no plain path"),
            (json!({"byteLength": 0, "uri": "a%2"}), "is no plain path"),
            (json!({"byteLength": 0, "uri": ""}), "is no plain path"),
            (json!({"byteLength": 0, "uri": "."}), "is no plain path"),
        ] {
            let error = loaded(json!([buffer]), None, &path).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
        let second = json!([{"byteLength": 0}, {"byteLength": 0}]);
        assert!(loaded(second, Some(b""), &path).unwrap_err().contains("buffers[1].uri: it is missing"));
    }
}
