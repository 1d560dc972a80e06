//! The command line as a user meets it: every verb of this release, its outputs, its errors and its exit status.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use habitus::io::npy;
use serde_json::Value;

fn habitus(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_habitus")).args(arguments).output().expect("the program starts")
}

/// Runs with `--json` and returns the object; fails with what the program said.
fn json(arguments: &[&str]) -> Value {
    let output = habitus(&[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.trim_end().lines().count(), 1, "one object: {text}");
    serde_json::from_str(&text).unwrap()
}

/// Runs what must be refused: exit status 1 and one sentence on stderr, which is returned.
fn refused(arguments: &[&str]) -> String {
    let output = habitus(arguments);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {text}");
    let errors: Vec<&str> = text.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(errors.len(), 1, "one sentence: {text}");
    errors[0].to_owned()
}

/// A small population and a model of it, made once.
struct Work {
    folder: PathBuf,
}

impl Work {
    fn path(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }
}

fn work() -> &'static Work {
    static WORK: OnceLock<Work> = OnceLock::new();
    WORK.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli");
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let work = Work { folder };
        let made = json(&["synth", "faces", "--identities", "6", "--level", "3", "-o", &work.path("faces")]);
        assert_eq!(made["identities"], 6);
        let trained = json(&train(&work, "face.hab").iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(trained["identity_dim"], 4);
        work
    })
}

/// `train face` of the population with everything.
fn train(work: &Work, output: &str) -> Vec<String> {
    let part = |name: &str| work.path(&format!("faces/{name}"));
    let mut words = vec!["train".into(), "face".into(), part("tensor.npy"), "--template".into(), part("template.ply")];
    words.extend(["--landmarks".into(), part("landmarks.json"), "--mirror".into(), part("mirror.npy")]);
    words.extend(["--expressions".into(), part("expressions.txt"), "--identity-dim".into(), "4".into()]);
    words.extend(["--expression-dim".into(), "5".into(), "-o".into(), work.path(output)]);
    words
}

#[test]
fn info_and_validate_tell_what_the_model_holds() {
    let work = work();
    let info = json(&["info", &work.path("face.hab")]);
    assert_eq!((&info["identity_dim"], &info["pose_dim"]), (&4.into(), &5.into()));
    assert_eq!(info["landmark_names"][4], "nose_tip");
    assert_eq!(info["expressions"][1], "smile");
    assert!(info["provenance"].as_str().unwrap().contains("tensor.npy"));
    assert_eq!(json(&["validate", &work.path("face.hab")])["sound"], true);
}

#[test]
fn every_format_of_generate_holds_the_same_face() {
    let work = work();
    let model = work.path("face.hab");
    let make = |name: &str| {
        let output = work.path(name);
        json(&["generate", &model, "--identity", "1.5,-1", "--expression-name", "smile", "-o", &output]);
        output
    };
    let (shape, expected) = npy::read_f64(make("smile.npy")).unwrap();
    assert_eq!(shape[1], 3);
    for name in ["smile.ply", "smile.obj", "smile.off"] {
        let mesh = habitus::io::mesh::read(make(name)).unwrap();
        assert_eq!(mesh.positions.as_flattened(), &expected[..], "{name}");
        assert!(!mesh.faces.is_empty());
    }
    let glb = std::fs::read(make("smile.glb")).unwrap();
    assert_eq!(&glb[..4], b"glTF");
    let neutral = work.path("neutral.npy");
    json(&["generate", &model, "-o", &neutral]);
    assert_ne!(npy::read_f64(neutral).unwrap().1, expected);
}

#[test]
fn random_faces_depend_on_the_seed_alone() {
    let work = work();
    let make = |name: &str, seed: &str| {
        let output = work.path(name);
        json(&["generate", &work.path("face.hab"), "--random", "--seed", seed, "-o", &output]);
        std::fs::read(output).unwrap()
    };
    assert_eq!(make("a.npy", "7"), make("b.npy", "7"));
    assert_ne!(make("a.npy", "7"), make("c.npy", "8"));
}

#[test]
fn export_writes_numpy_and_morph_targets() {
    let work = work();
    json(&["export", &work.path("face.hab"), "-o", &work.path("face.npz")]);
    assert_eq!(&std::fs::read(work.path("face.npz")).unwrap()[..2], b"PK");
    let exported = json(&["export", &work.path("face.hab"), "-o", &work.path("face.glb")]);
    assert_eq!(exported["morph_targets"], 8 + 4);
    let glb = std::fs::read(work.path("face.glb")).unwrap();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    assert_eq!(document["meshes"][0]["extras"]["targetNames"][1], "smile");
    assert!(refused(&["export", &work.path("face.hab"), "-o", "face.xyz"]).contains(".npz or .glb"));
}

#[test]
fn measures_are_printed() {
    let work = work();
    let tensor = work.path("faces/tensor.npy");
    let figures = json(&["measure", "model", &tensor, "--test", &tensor, "--dims", "2x3,5x8", "--samples", "20"]);
    let sizes = figures["sizes"].as_array().unwrap();
    assert!(sizes[0]["training_error_mean_mm"].as_f64() > sizes[1]["training_error_mean_mm"].as_f64());
    assert!(sizes[0]["unseen_error_mean_mm"].as_f64().unwrap() > 0.0);
    for curve in
        ["generalization_identity", "generalization_expression", "specificity_identity", "specificity_expression"]
    {
        assert!(figures[curve].as_array().unwrap().len() > 2, "{curve}");
    }
    let figures = json(&["measure", "model", &work.path("face.hab"), "--test", &tensor]);
    assert!(figures["identity_energy_percent"].as_f64().unwrap() > 50.0);
    assert!(figures["unseen_error_mean_mm"].as_f64().unwrap() < 3.0, "{figures}");
}

#[test]
fn training_is_the_same_for_any_number_of_threads() {
    let work = work();
    for threads in ["1", "3"] {
        let output = format!("threads_{threads}.hab");
        let mut words = train(work, &output);
        words.extend(["--threads".into(), threads.into()]);
        json(&words.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(std::fs::read(work.path(&output)).unwrap(), std::fs::read(work.path("face.hab")).unwrap());
    }
}

/// The same shapes as one tensor and as a collection of mesh files give the same model.
#[test]
fn a_collection_trains_the_same_model() {
    let work = work();
    let (shape, values) = npy::read_f64(work.path("faces/tensor.npy")).unwrap();
    let template = habitus::io::mesh::read(work.path("faces/template.ply")).unwrap();
    std::fs::create_dir_all(work.path("collection")).unwrap();
    let mut list = format!("{} #Expressions\n{} #Identities\n", shape[1], shape[0]);
    let face = 3 * shape[2];
    for expression in 0..shape[1] {
        for identity in 0..shape[0] {
            let name = format!("face_{identity}_{expression}.ply");
            let positions = values[(identity * shape[1] + expression) * face..][..face].as_chunks::<3>().0.to_vec();
            let mesh = habitus::mesh::Mesh { positions, ..template.clone() };
            habitus::io::mesh::write(work.path(&format!("collection/{name}")), &mesh).unwrap();
            list += &format!("{name}\n");
        }
    }
    let list_path = work.path("collection/faces.txt");
    std::fs::write(&list_path, &list).unwrap();
    let mut words = train(work, "collection.hab");
    words[2] = list_path.clone();
    json(&words.iter().map(String::as_str).collect::<Vec<_>>());
    let sections = |name: &str| {
        let bytes = std::fs::read(work.path(name)).unwrap();
        let model = habitus_core::format::Model::open(&bytes).unwrap();
        let named = |section: habitus_core::format::Section<'_>| (section.id, section.bytes.to_vec());
        model.sections().iter().filter(|section| section.id != 16).map(named).collect::<Vec<_>>()
    };
    assert!(sections("collection.hab") == sections("face.hab"), "all but the provenance is equal");
    std::fs::remove_file(work.path("collection/face_2_3.ply")).unwrap();
    let error = refused(&["train", "face", &list_path, "-o", &work.path("x.hab")]);
    assert!(error.contains("identity 2, expression 3 is missing"), "{error}");
}

/// Item 5 of the face spine: a sentence each.
#[test]
fn bad_training_data_get_a_sentence_each() {
    let work = work();
    let (shape, mut values) = npy::read_f64(work.path("faces/tensor.npy")).unwrap();
    let output = work.path("refused.hab");
    let face = 3 * shape[2];
    let write = |name: &str, shape: &[usize], values: &[f64]| {
        npy::write_f64(work.path(name), shape, values).unwrap();
        work.path(name)
    };

    let one_person = write("one_identity.npy", &[1, shape[1], shape[2], 3], &values[..shape[1] * face]);
    let trained = json(&["train", "face", &one_person, "--align", "none", "-o", &output]);
    let warnings = trained["warnings"].to_string();
    assert!(warnings.contains("one identity") && trained["identity_dim"] == 1, "{warnings}");
    let measured = json(&["measure", "model", &one_person, "--align", "none"]);
    assert!(measured["warnings"].to_string().contains("curves are left out"), "{measured}");

    let neutral: Vec<f64> =
        (0..shape[0]).flat_map(|identity| values[identity * shape[1] * face..][..face].to_vec()).collect();
    let one_expression = write("one_expression.npy", &[shape[0], 1, shape[2], 3], &neutral);
    let trained = json(&["train", "face", &one_expression, "-o", &output]);
    let warnings = trained["warnings"].to_string();
    assert!(warnings.contains("one expression") && trained["expression_dim"] == 1, "{warnings}");

    values[(2 * shape[1] + 3) * face + 3 * 17 + 1] = f64::NAN;
    let nan = write("nan.npy", &shape, &values);
    let error = refused(&["train", "face", &nan, "-o", &output]);
    assert!(error.contains("identity 2, expression 3, vertex 17, axis y"), "{error}");

    let flat = write("flat.npy", &[shape[0] * shape[1], shape[2], 3], &vec![0.0; values.len()]);
    assert!(refused(&["train", "face", &flat, "-o", &output]).contains("four axes"));

    let tensor = work.path("faces/tensor.npy");
    let cube = work.path("cube.obj");
    std::fs::write(&cube, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let error = refused(&["train", "face", &tensor, "--template", &cube, "-o", &output]);
    assert!(error.contains("the template has 3 vertices"), "{error}");
    let beyond = work.path("beyond.npy");
    npy::write_u32(&beyond, &[1, 3], &[0, 1, 99_999]).unwrap();
    let error = refused(&["train", "face", &tensor, "--template", &beyond, "-o", &output]);
    assert!(error.contains("names vertex 99999"), "{error}");
    let triangles = work.path("triangles.npy");
    npy::write_u32(&triangles, &[1, 3], &[0, 1, 2]).unwrap();
    let points = work.path("points.txt");
    std::fs::write(&points, "1\nnose_tip\n0 0 0\n").unwrap();
    let error = refused(&["train", "face", &tensor, "--template", &triangles, "--landmarks", &points, "-o", &output]);
    assert!(error.contains("need a template mesh"), "{error}");
    let error = refused(&["train", "face", &tensor, "--identity-dim", "7", "-o", &output]);
    assert!(error.contains("hold 6 identities"), "{error}");
    assert!(refused(&["train", "face", "absent.npy", "-o", &output]).contains("absent.npy"));
    assert!(refused(&["train", "face", &tensor, "-o", "face.txt"]).contains(".hab"));
}

#[test]
fn what_the_model_lacks_is_said() {
    let work = work();
    let bare = work.path("bare.hab");
    let trained = json(&["train", "face", &work.path("faces/tensor.npy"), "--identity-dim", "2", "-o", &bare]);
    let warnings = trained["warnings"].to_string();
    assert!(warnings.contains("no triangles") && warnings.contains("no landmarks"), "{warnings}");
    assert!(refused(&["generate", &bare, "-o", &work.path("bare.ply")]).contains("no triangles"));
    json(&["generate", &bare, "-o", &work.path("bare.npy")]);
    assert!(refused(&["generate", &bare, "--expression-name", "smile", "-o", "x.npy"]).contains("--expressions"));
}

#[test]
fn wrong_use_of_a_model_is_refused() {
    let work = work();
    let model = work.path("face.hab");
    let error = refused(&["generate", &model, "--expression-name", "grin", "-o", "x.ply"]);
    assert!(error.contains("it knows neutral, smile"), "{error}");
    assert!(refused(&["generate", &model, "--identity", "1,2,3,4,5", "-o", "x.ply"]).contains("this model has 4"));
    assert!(refused(&["generate", &model, "--identity", "nan", "-o", "x.ply"]).contains("not a finite number"));
    assert!(refused(&["generate", &model, "-o", "x.docx"]).contains("x.docx"));
    assert!(refused(&["info", &work.path("faces/faces.png")]).contains("not a .hab model file"));
    assert!(refused(&["validate", &work.path("faces/template.ply")]).contains("not a .hab model file"));
    let mut bytes = std::fs::read(&model).unwrap();
    bytes.truncate(5000);
    std::fs::write(work.path("short.hab"), &bytes).unwrap();
    assert!(refused(&["validate", &work.path("short.hab")]).contains("copy or download it again"));
}

#[test]
fn usage_errors_have_their_own_status() {
    let cases: [&[&str]; 7] = [
        &["train"],
        &["fly"],
        &["generate"],
        &["measure", "model", "x", "--dims", "20"],
        &["info", "x.hab", "--threads", "0"],
        &["info", "x.hab", "--threads", "20000"],
        &["synth", "faces", "--level", "9", "-o", "x"],
    ];
    for arguments in cases {
        assert_eq!(habitus(arguments).status.code(), Some(2), "{arguments:?}");
    }
    assert_eq!(habitus(&["--help"]).status.code(), Some(0));
}

/// The reader of the output goes away, or its disk is full: no stack trace.
#[cfg(target_os = "linux")]
#[test]
fn a_lost_output_is_no_fault() {
    let run = |script: &str| {
        let script =
            script.replace("HABITUS", env!("CARGO_BIN_EXE_habitus")).replace("MODEL", &work().path("face.hab"));
        Command::new("sh").args(["-c", &script]).output().unwrap()
    };
    let gone = run("{ HABITUS info MODEL; echo status $? >&2; } | true");
    assert_eq!(String::from_utf8_lossy(&gone.stderr).trim(), "status 0");
    let full = run("HABITUS info MODEL > /dev/full");
    assert_eq!(full.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&full.stderr).starts_with("error: standard output: cannot be written"));
}

#[cfg(target_os = "linux")]
#[test]
fn outlandish_paths_are_survived() {
    use std::os::unix::ffi::OsStringExt;
    let output = std::ffi::OsString::from_vec([work().path("a").into_bytes(), vec![0xff], b".npy".to_vec()].concat());
    let run = Command::new(env!("CARGO_BIN_EXE_habitus"))
        .args(["generate", &work().path("face.hab"), "--json", "-o"])
        .arg(&output)
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert!(Path::new(&output).exists());
    assert!(refused(&["info", "/dev/zero"]).contains("no regular file"));
    assert!(refused(&["info", &work().path("faces")]).contains("no regular file"));
}

#[test]
fn names_are_checked_before_training() {
    let work = work();
    let names = work.path("twice.txt");
    std::fs::write(&names, "a\nb\na\nd\ne\nf\ng\nh\n").unwrap();
    let tensor = work.path("faces/tensor.npy");
    let output = work.path("x.hab");
    let error = refused(&["train", "face", &tensor, "--expressions", &names, "-o", &output]);
    assert!(error.contains("\"a\" stands twice"), "{error}");
    std::fs::write(&names, b"a\xff\nb\nc\nd\ne\nf\ng\nh\n").unwrap();
    let error = refused(&["train", "face", &tensor, "--expressions", &names, "-o", &output]);
    assert!(error.contains("not UTF-8"), "{error}");
}

#[test]
fn an_archive_trains_like_its_tensor() {
    let work = work();
    let (shape, values) = npy::read_f64(work.path("faces/tensor.npy")).unwrap();
    let mut npz = npy::NpzWriter::new();
    npz.add("tensor", &shape, &values[..]).unwrap();
    npz.add("other", &[1], &[0.0f64][..]).unwrap();
    npz.finish(work.path("faces.npz")).unwrap();
    let figures = |data: &str, output: &str| {
        json(&["train", "face", data, "--identity-dim", "3", "-o", &work.path(output)])["training_error_mean_mm"]
            .clone()
    };
    assert_eq!(figures(&work.path("faces.npz"), "z.hab"), figures(&work.path("faces/tensor.npy"), "y.hab"));
}

/// A square and a loose vertex, with everything that some format cannot hold.
const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar label\nelement face 1\n\
    property list uchar int vertex_indices\nproperty int flags\nend_header\n\
    0 0 0.1 1 2 3 7\n1 0 0.1 1 2 3 8\n1 1 0.1 1 2 3 9\n0 1 0.1 1 2 3 9\n5 5 0.1 0 0 0 0\n4 0 1 2 3 5\n";

#[test]
fn convert_says_what_is_lost() {
    let work = work();
    let input = work.path("square.ply");
    std::fs::write(&input, SQUARE).unwrap();
    let convert = |from: &str, to: &str| json(&["convert", from, "-o", to]);
    for (name, n_warnings) in [("square_copy.ply", 2), ("square.obj", 3), ("square.off", 3), ("square.npy", 5)] {
        let output = work.path(name);
        let converted = convert(&input, &output);
        assert_eq!((&converted["vertices"], &converted["faces"]), (&5.into(), &2.into()));
        let warnings = converted["warnings"].as_array().unwrap();
        assert_eq!(warnings.len(), n_warnings, "{warnings:?}");
        assert!(
            warnings[0]
                .as_str()
                .unwrap()
                .ends_with("not kept: 1 polygon with more than 3 corners (divided into triangles)")
        );
        let mesh = habitus::io::mesh::read(&output).unwrap();
        assert_eq!((mesh.positions.len(), mesh.positions[4]), (5, [5.0, 5.0, 0.1]));
    }
    for (encoding, word) in [("binary", "binary_little"), ("big-endian", "binary_big"), ("text", "ascii")] {
        let output = work.path("encoded.ply");
        json(&["convert", &input, "--encoding", encoding, "-o", &output]);
        assert!(String::from_utf8_lossy(&std::fs::read(&output).unwrap()).contains(&format!("format {word}")));
    }
    assert!(refused(&["convert", &input, "--encoding", "text", "-o", "x.obj"]).contains("leave out --encoding"));
    assert!(refused(&["convert", &input, "-o", "x.docx"]).contains("known extensions: obj, ply"));
    let broken = work.path("broken.obj");
    std::fs::write(&broken, "v 0 0 nan\n").unwrap();
    assert!(refused(&["convert", &broken, "-o", "x.ply"]).contains("line 1: the vertex has \"nan\""));
    let nowhere = work.path("nowhere/x.ply");
    let message = refused(&["convert", &input, "-o", &nowhere]);
    assert!(message.contains(&format!("{nowhere}: cannot be written: there is no folder ")), "{message}");
    let far = work.path("far.obj");
    std::fs::write(&far, "v 0 0 0\nv 1 0 0\nv 0 1e300 0\nf 1 2 3\n").unwrap();
    assert!(
        refused(&["clean", &far])
            .contains("far.obj: vertex 2 is at [0.0, 1e300, 0.0]: coordinates must be at most 1e70")
    );
}

#[test]
fn info_describes_meshes() {
    let work = work();
    let input = work.path("info.ply");
    std::fs::write(&input, SQUARE).unwrap();
    let info = json(&["info", &input]);
    assert_eq!((&info["kind"], &info["edges"], &info["boundary_edges"]), (&"mesh".into(), &5.into(), &4.into()));
    assert_eq!((&info["closed"], &info["unreferenced_vertices"]), (&false.into(), &1.into()));
    assert_eq!(info["box_diagonal"].as_f64(), Some(50f64.sqrt()));
    assert_eq!(info["attributes"][0]["name"], "label");
    assert_eq!((&info["attributes"][0]["high"], &info["attributes"][0]["type"]), (&9.0.into(), &"U8".into()));
    assert_eq!(info["not_kept"].as_array().unwrap().len(), 2);
    let text = String::from_utf8(habitus(&["info", &input]).stdout).unwrap();
    assert!(text.contains("5 vertices, 2 faces, open") && text.contains("\"label\" (U8): 0 to 9"), "{text}");
    assert!(text.contains("components: 1, boundary loops: 1, genus 0, area 1\n"), "{text}");
    assert_eq!((&info["components"], &info["boundary_loops"], &info["genus"]), (&1.into(), &1.into(), &0.into()));
    assert_eq!((&info["area"], &info["volume"]), (&1.0.into(), &Value::Null));
    let broken = work.path("nan.obj");
    std::fs::write(&broken, "v 0 0 nan\nv 1 2 3\nv 1 2 4\nf 1 2 3\nf 2 2 3\n").unwrap();
    let info = json(&["info", &broken]);
    assert_eq!((&info["non_finite_vertices"], &info["degenerate_faces"]), (&1.into(), &2.into()));
    assert_eq!(info["box_low"], serde_json::json!([1.0, 2.0, 3.0]));
}

#[test]
fn info_tells_how_the_faces_hang_together() {
    let work = work();
    let input = work.path("surface.obj");
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 6\nv 9 9 9\nv 9 8 9\n";
    let told = |faces: &str| {
        std::fs::write(&input, format!("{corners}{faces}")).unwrap();
        json(&["info", &input])
    };
    // A tetrahedron, inside out, with one face turned, and without that face.
    let info = told("f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    assert_eq!((&info["volume"], &info["genus"], &info["boundary_loops"]), (&1.0.into(), &0.into(), &0.into()));
    assert_eq!(told("f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n")["volume"], -1.0);
    let info = told("f 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    assert_eq!((&info["inconsistent_edges"], &info["volume"], &info["genus"]), (&3.into(), &Value::Null, &0.into()));
    // Two triangles that meet in one vertex.
    let info = told("f 1 2 3\nf 1 5 6\n");
    assert_eq!((&info["non_manifold_vertices"], &info["boundary_loops"]), (&1.into(), &2.into()));
    assert_eq!((&info["genus"], &info["no_genus"]), (&Value::Null, &"not a manifold".into()));
    let info = told("");
    assert_eq!((&info["components"], &info["area"]), (&0.into(), &Value::Null));
}

#[test]
fn clean_writes_a_sound_mesh_and_tells_what_it_did() {
    let work = work();
    let (input, output, report) = (work.path("broken.obj"), work.path("sound.ply"), work.path("sound.json"));
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 0\nv 7 7 7\nf 1 2 3\nf 1 3 4\nf 5 3 1\nf 4 3 1\n";
    std::fs::write(&input, square).unwrap();
    let said = json(&["clean", &input, "-o", &output, "--report", &report]);
    assert_eq!(said["changes"].as_array().unwrap().len(), 4, "{said}");
    assert_eq!(said["welded_vertices"], serde_json::json!({ "count": 1, "examples": [4] }));
    assert_eq!((&said["duplicate_faces"]["count"], &said["opposite_faces"]["count"]), (&1.into(), &1.into()));
    assert_eq!(said["components"][0]["boundary_loops"], 1);
    let mesh = habitus::io::mesh::read(&output).unwrap();
    assert_eq!((mesh.positions.len(), mesh.faces.len()), (4, 2));
    let whole: Value = serde_json::from_slice(&std::fs::read(&report).unwrap()).unwrap();
    assert_eq!(whole["old_of_vertex"], serde_json::json!([0, 1, 2, 3]));
    assert_eq!(json(&["clean", &output])["unchanged"], true);
    // What is read stays.
    for arguments in [
        &["clean", &input, "-o", &input][..],
        &["clean", &input, "-o", &output, "--template", &output],
        &["convert", &input, "-o", &work.path("faces/../broken.obj")],
        &["measure", "distance", &output, &input, "--ply", &output],
    ] {
        assert!(refused(arguments).contains("would overwrite an input"), "{arguments:?}");
    }
    assert_eq!(std::fs::read_to_string(&input).unwrap(), square);
    let text = String::from_utf8(habitus(&["clean", &input]).stdout).unwrap();
    assert!(text.contains("changed: 1 vertices welded to an earlier one at their place (4)"), "{text}");
}

#[test]
fn clean_of_several_files_is_a_table() {
    let work = work();
    let (one, other) = (work.path("one.obj"), work.path("other.obj"));
    std::fs::write(&one, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 2 3\n").unwrap();
    std::fs::write(&other, "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n").unwrap();
    let said = json(&["clean", &one, &other]);
    assert_eq!(said["files"][0]["duplicate_faces"]["count"], 1);
    assert!(said["files"][1]["error"].as_str().unwrap().contains("nothing is left of the 1 faces"));
    let text = String::from_utf8(habitus(&["clean", &one, &one]).stdout).unwrap();
    let widths: Vec<usize> = text.lines().map(str::len).collect();
    assert!(widths.len() == 3 && widths.iter().all(|&width| width == widths[0]), "{text}");
    assert!(refused(&["clean", &other, &other]).contains("none of the 2 inputs"));
    assert!(refused(&["clean", &one, &one, "-o", &work.path("x.ply")]).contains("give one input"));
    assert_eq!(habitus(&["clean", &one, "--keep", "2"]).status.code(), Some(2));
}
