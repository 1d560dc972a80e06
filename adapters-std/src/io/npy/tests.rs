//! Tests of NPY and NPZ: types, orders, damaged files, and what `npyz` makes of the files written here.

use super::*;
use proptest::prelude::*;

/// An NPY file of version 1 with this dictionary text and these bytes of values.
fn file(dictionary: &str, values: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend_from_slice(&(dictionary.len() as u16).to_le_bytes());
    bytes.extend_from_slice(dictionary.as_bytes());
    bytes.extend_from_slice(values);
    bytes
}

fn array_file(descr: &str, fortran: &str, shape: &str, values: &[u8]) -> Vec<u8> {
    file(&format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}  \n"), values)
}

fn read(bytes: &[u8]) -> (Vec<usize>, Vec<f64>) {
    parse_f64(bytes, Path::new("t.npy")).expect("an NPY file")
}

fn error(bytes: &[u8]) -> String {
    parse_f64(bytes, Path::new("t.npy")).expect_err("must be refused").to_string()
}

#[test]
fn every_type_and_byte_order_is_read() {
    macro_rules! check {
        ($($name:literal $type:ty: $values:expr;)*) => {$(
            let values: [$type; 2] = $values;
            let wanted: Vec<f64> = values.iter().map(|&x| x as f64).collect();
            let big: Vec<u8> = values.iter().flat_map(|x| x.to_be_bytes()).collect();
            let little: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
            assert_eq!(read(&array_file(concat!(">", $name), "False", "(2,)", &big)), (vec![2], wanted.clone()));
            assert_eq!(read(&array_file(concat!("<", $name), "False", "(2,)", &little)), (vec![2], wanted));
        )*};
    }
    check! {
        "f4" f32: [1.5, -3e30]; "f8" f64: [0.1, f64::MAX];
        "i1" i8: [-128, 127]; "i2" i16: [-32768, 5]; "i4" i32: [i32::MIN, 7]; "i8" i64: [-(1 << 53), 9];
        "u1" u8: [0, 255]; "u2" u16: [1, 65535]; "u4" u32: [2, u32::MAX];
    }
    let halves = [0x3C00u16, 0xC000, 0x7BFF, 0x0001, 0x3555].map(u16::to_le_bytes).concat();
    let third = 0.333251953125;
    assert_eq!(read(&array_file("<f2", "False", "(5,)", &halves)).1, [1.0, -2.0, 65504.0, 2f64.powi(-24), third]);
    assert!(half(0x7C00) == f64::INFINITY && half(0xFC00) == f64::NEG_INFINITY && half(0x7E00).is_nan());
    assert_eq!(read(&array_file("|u1", "False", "()", &[7])), (vec![], vec![7.0]));
}

#[test]
fn fortran_order_becomes_c_order() {
    // a[i][j][k] = 100 i + 10 j + k, the first index fastest.
    let mut values = Vec::new();
    for k in 0..4u8 {
        for j in 0..3u8 {
            values.extend((0..2u8).map(|i| 100 * i + 10 * j + k));
        }
    }
    let (shape, read) = read(&array_file("|u1", "True", "(2, 3, 4)", &values));
    assert_eq!(shape, [2, 3, 4]);
    for (at, value) in read.iter().enumerate() {
        assert_eq!(*value, (100 * (at / 12) + 10 * (at / 4 % 3) + at % 4) as f64);
    }
}

#[test]
fn indices_are_not_negative_and_not_real() {
    let indices = |descr, values: &[u8]| {
        parse_u32(&array_file(descr, "False", "(2,)", values), Path::new("t.npy")).map_err(|error| error.to_string())
    };
    assert_eq!(indices("<u2", &[1, 0, 255, 255]).expect("indices").1, [1, 65535]);
    assert!(indices("|i1", &[3, 255]).unwrap_err().contains("byte 71: value 1 is -1; an index"));
    assert!(indices("<i8", &[[0xFF; 8], [0x0F; 8]].concat()).unwrap_err().contains("byte 70: value 0 is -1"));
    assert!(indices("<f4", &[0; 8]).unwrap_err().contains("byte 20: real numbers where indices"));
}

#[test]
fn errors_name_the_byte_and_the_remedy() {
    let valid = array_file("<f4", "False", "(3,)", &[0; 12]);
    let mut version = valid.clone();
    version[6] = 9;
    for (bytes, message) in [
        (b"abc".to_vec(), "at least 10 bytes"),
        (b"0123456789".to_vec(), "byte 0: an NPY file begins with"),
        (version, "byte 6: NPY version 9 is not read"),
        (valid[..valid.len() - 1].to_vec(), "shape [3] of 4 bytes each, but 11 bytes follow"),
        (valid[..20].to_vec(), "byte 8: a header of"),
        (array_file("<f4", "False", "(4294967296, 4294967296)", &[0; 12]), "but 12 bytes follow the header"),
        (array_file("<f4", "False", "(99999999999999999999,)", &[]), "where an extent of the shape"),
        (array_file("<f4", "False", "(-1,)", &[]), "\"-1,), }"),
        (array_file("<c8", "False", "(1,)", &[0; 8]), "values of type \"<c8\" are not read; convert"),
        (array_file("f4", "False", "(1,)", &[0; 4]), "values of type \"f4\""),
        (array_file("<i8", "False", "(1,)", &[0x7F; 8]), "byte 70: the integer 9187201950435737471 is beyond 2^53"),
        (array_file("<f4", "false", "(1,)", &[0; 4]), "where True or False is expected"),
        (file("{'descr': [('a', '<f4')], }", &[]), "records of several fields are not read"),
        (file("{'descr': '<f4', }", &[]), "lacks one of descr, fortran_order and shape"),
        (file("{'descr': '<f4', 'colour': 1}", &[]), "the key \"colour\" is not known"),
        (file("{((((((((", &[]), "where a string is expected"),
    ] {
        assert!(error(&bytes).contains(message), "{message}: {}", error(&bytes));
    }
}

#[test]
fn values_have_their_byte_in_either_order() {
    let bytes = array_file("<f4", "True", "(2, 3, 4)", &[0; 96]);
    let header = header(&bytes, Path::new("t")).expect("a header");
    let stored: Vec<u64> = in_c_order(&header.shape, &(0..24).collect::<Vec<_>>());
    for (index, at) in stored.into_iter().enumerate() {
        assert_eq!(header.byte_of(index), header.body as u64 + 4 * at);
    }
    assert_eq!(&bytes[header.shape_at..][..9], b"(2, 3, 4)");
    assert_eq!(&bytes[header.type_at..][..5], b"'<f4'");
}

#[test]
fn a_long_header_of_version_2_is_read() {
    let text = format!("{{'descr': \"<f8\", 'fortran_order': False, 'shape': (1,)}}{}\n", " ".repeat(70_000));
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    bytes.extend_from_slice(&(text.len() as u32).to_le_bytes());
    bytes.extend_from_slice(text.as_bytes());
    bytes.extend_from_slice(&2.5f64.to_le_bytes());
    assert_eq!(read(&bytes), (vec![1], vec![2.5]));
}

#[test]
fn hostile_bytes_are_refused_or_harmless() {
    let path = Path::new("hostile");
    for bytes in [array_file("<f4", "True", "(2, 3)", &[1; 24]), array_file(">i8", "False", "(0, 2)", &[])] {
        let judge = |bytes: &[u8]| {
            for outcome in
                [parse_f64(bytes, path).map(|(s, v)| (s, v.len())), parse_u32(bytes, path).map(|(s, v)| (s, v.len()))]
            {
                match outcome {
                    Ok((shape, n)) => assert_eq!(shape.iter().product::<usize>(), n),
                    Err(error) => assert!(matches!(error, Error::Malformed { .. }), "{error}"),
                }
            }
        };
        for length in 0..bytes.len() {
            judge(&bytes[..length]);
        }
        let mut changed = bytes.clone();
        for at in 0..bytes.len() {
            for byte in 0..=255 {
                changed[at] = byte;
                judge(&changed);
            }
            changed[at] = bytes[at];
        }
    }
}

#[test]
fn shapes_must_fit_the_values() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.npy");
    let message = write_f32(&path, &[2, 2], &[1.0; 3]).expect_err("must fail").to_string();
    assert!(message.contains("3 values for an array of shape [2, 2]"), "{message}");
    assert!(!path.exists());
}

#[test]
fn archives_hold_their_arrays_and_are_reproducible() {
    let folder = tempfile::tempdir().expect("folder");
    let (first, second) = (folder.path().join("a.npz"), folder.path().join("b.npz"));
    let (reals, doubles, indices) = (vec![1.5f32, -2.0], vec![0.1f64; 6], vec![7u32, u32::MAX]);
    let mut npz = NpzWriter::new();
    npz.add("mean", &[2, 1], &reals[..]).expect("add");
    npz.add("core", &[1, 2, 3], &doubles[..]).expect("add");
    npz.add("faces", &[2], &indices[..]).expect("add");
    assert!(npz.add("faces", &[2], &indices[..]).is_err());
    assert!(npz.add("short", &[3], &indices[..]).is_err());
    npz.finish(&first).expect("write");
    npz.finish(&second).expect("write");
    assert_eq!(std::fs::read(&first).expect("read"), std::fs::read(&second).expect("read"));
    let mut archive = npyz::npz::NpzArchive::open(&first).expect("an archive");
    let core = archive.by_name("core").expect("an array").expect("core");
    assert_eq!(core.shape(), [1, 2, 3]);
    assert_eq!(core.into_vec::<f64>().expect("values"), doubles);
    let faces = archive.by_name("faces").expect("an array").expect("faces");
    assert_eq!(faces.into_vec::<u32>().expect("values"), indices);
    let mean = archive.by_name("mean").expect("an array").expect("mean");
    assert_eq!(mean.into_vec::<f32>().expect("values"), reals);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn arrays_read_back(
        (shape, values) in prop::collection::vec(0usize..5, 0..4).prop_flat_map(|shape| {
            let n = shape.iter().product::<usize>();
            (Just(shape), prop::collection::vec(any::<u32>(), n))
        })
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        write_u32(&path, &shape, &values).unwrap();
        prop_assert_eq!(read_u32(&path).unwrap(), (shape.clone(), values.clone()));
        let reals: Vec<f32> = values.iter().map(|&x| x as f32 / 7.0).collect();
        write_f32(&path, &shape, &reals).unwrap();
        let wide: Vec<f64> = reals.iter().map(|&x| f64::from(x)).collect();
        prop_assert_eq!(read_f64(&path).unwrap(), (shape.clone(), wide));
        let reals: Vec<f64> = values.iter().map(|&x| f64::from(x) / 7.0).collect();
        write_f64(&path, &shape, &reals).unwrap();
        prop_assert_eq!(read_f64(&path).unwrap(), (shape, reals));
    }
}
