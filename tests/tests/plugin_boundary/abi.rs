//! Libraries that are no plugins of this ABI.

use crate::build::{self, c_phase, folder, library_name, write};
use crate::drive::{fault, haze, registry, registry_before, says, scene};
use resolvent_api::PluginKind;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A scene that names a library where a phase function belongs.
fn naming(library: &Path) -> Value {
    let mut s = haze("none");
    s["media"]["haze"]["params"]["phase"] = json!({ "plugin": library });
    s
}

/// Checks that a library is refused with its path, the place in the scene, and these words.
#[track_caller]
fn refused(library: &Path, words: &[&str]) {
    let f = fault(&naming(library));
    says(
        &f.text,
        &[
            "test.json:",
            "$.media.haze.params.phase",
            &library.display().to_string(),
        ],
    );
    says(&f.text, words);
}

fn file(name: &str, content: &[u8]) -> PathBuf {
    let path = folder("abi").join(library_name(name));
    write(&path, content);
    path
}

/// Both versions, and who is to be updated.
#[test]
fn other_versions() {
    let newer = c_phase("newer", &["ABI_MAJOR=2", "ABI_MINOR=5", "HEADER_SIZE=4096"]);
    let words = [
        "was built for plugin ABI 2.5",
        "this resolvent has ABI 1",
        "update resolvent",
    ];
    refused(&newer, &words);
    // An older version may have had another header behind its first integers.
    let older = c_phase("older", &["ABI_MAJOR=0", "ABI_MINOR=9", "HEADER_SIZE=24"]);
    let words = [
        "was built for plugin ABI 0.9",
        "this resolvent has ABI 1",
        "must be rebuilt",
    ];
    refused(&older, &words);
}

/// A newer minor version only appends.
#[test]
fn newer_minor_versions_are_welcome() {
    let library = c_phase(
        "minor",
        &[
            "ABI_MINOR=7",
            "HEADER_SIZE=sizeof(resolvent_header)+64",
            "TABLE_SIZE=4096",
        ],
    );
    let plugin = registry().load(PluginKind::Phase, &library);
    assert_eq!(
        plugin
            .map(|p| p.name().to_owned())
            .map_err(|e| e.to_string()),
        Ok("linear".into())
    );
}

#[test]
fn headers_that_lie() {
    let no_header = "is no plugin header";
    for (name, definitions, word) in [
        (
            "magic",
            &["MAGIC={'R','E','S','O','L','V','N','X'}"][..],
            no_header,
        ),
        ("magic_zero", &["MAGIC={0}"], no_header),
        (
            "header_small",
            &["HEADER_SIZE=40"],
            "its header has 40 bytes instead of",
        ),
        (
            "header_zero",
            &["HEADER_SIZE=0"],
            "its header has 0 bytes instead of",
        ),
        ("kind", &["KIND=9"], "is of an unknown kind (9)"),
        ("kind_zero", &["KIND=0"], "is of an unknown kind (0)"),
        ("table_none", &["TABLE=0"], "has no function table"),
        (
            "table_askew",
            &["TABLE=((const char*)&table+4)"],
            "has no function table",
        ),
        (
            "table_small",
            &["TABLE_SIZE=16"],
            "its function table has 16 bytes instead of",
        ),
        (
            "table_zero",
            &["TABLE_SIZE=0"],
            "its function table has 0 bytes instead of",
        ),
        ("kind_other", &["KIND=1"], "its function table has"),
        ("name", &["NAME=\"a plugin\""], "has the name \"a plugin\""),
        ("name_none", &["NAME=\"\""], "has the name \"\""),
        (
            "param_size",
            &["PARAM_SIZE=8"],
            "its parameter declarations have 8 bytes each",
        ),
        (
            "param_size_odd",
            &["PARAM_SIZE=1001"],
            "its parameter declarations have 1001 bytes each",
        ),
        (
            "param_none",
            &["PARAMS=0", "PARAM_COUNT=3"],
            "promises 3 parameter declarations",
        ),
        (
            "param_kind",
            &["PARAM_KIND=99"],
            "declares the parameter 'a' with the unknown type 99",
        ),
        (
            "param_default",
            &["PARAM_DEFAULT=\"0,\""],
            "declares the default 0, of 'a'",
        ),
        (
            "symbol",
            &["SYMBOL=resolvent_plugout"],
            "exports no symbol `resolvent_plugin`",
        ),
    ] {
        refused(&c_phase(name, definitions), &[word]);
    }
}

#[test]
fn files_that_are_no_libraries() {
    let none = "is no shared library that can be loaded here";
    refused(
        &file("text", b"This is not the library you are looking for.\n"),
        &[none],
    );
    refused(&file("empty", b""), &[none]);
    let whole = std::fs::read(c_phase("whole", &[])).unwrap_or_else(|e| panic!("{e}"));
    // Loading what is there of it would end the program.
    for length in [63, 100, 700, whole.len() / 2] {
        let words = [none, "bytes at its end are missing"];
        refused(&file(&format!("cut_{length}"), &whole[..length]), &words);
    }
    let directory = folder("abi").join("folder").join(library_name("folder"));
    std::fs::create_dir_all(&directory).unwrap_or_else(|e| panic!("{e}"));
    refused(&directory, &["is no file"]);
    refused(
        &folder("abi").join(library_name("nothing")),
        &["cannot be opened", "No such file"],
    );
}

/// A library for another processor.
#[test]
#[cfg(target_os = "linux")]
fn of_another_architecture() {
    let mut library = std::fs::read(c_phase("whole_too", &[])).unwrap_or_else(|e| panic!("{e}"));
    // e_machine: AArch64, or x86-64 where that is this machine's own.
    let other: u16 = if cfg!(target_arch = "aarch64") {
        62
    } else {
        183
    };
    library[18..20].copy_from_slice(&other.to_ne_bytes());
    let (other, own) = if cfg!(target_arch = "aarch64") {
        ("x86-64", "AArch64")
    } else {
        ("AArch64", "x86-64")
    };
    let words = format!("it was built for {other}, and this is {own}");
    refused(&file("foreign", &library), &[&words]);
    // 32 bits, for a processor nobody has heard of.
    library[4] = 1;
    library[18..20].copy_from_slice(&999u16.to_ne_bytes());
    refused(
        &file("narrow", &library),
        &["it was built for processor 999"],
    );
    refused(&file("dll", b"MZ and so on"), &["it was built for Windows"]);
    refused(
        &file("dylib", b"\xcf\xfa\xed\xfe"),
        &["it was built for macOS"],
    );
}

/// A library that needs one that is not there: the missing one is named.
#[test]
#[cfg(target_os = "linux")]
fn with_a_missing_dependency() {
    let library = build::c_phase_that_needs_another();
    refused(
        &library,
        &["is no shared library that can be loaded here", "libgone.so"],
    );
}

/// A plugin of another kind than the place asks for, by path and by name.
#[test]
fn of_another_kind() {
    let wrong = "is a plugin of the kind bsdf where one of the kind phase is needed";
    refused(&build::unruly("bsdf"), &[wrong]);
    let mut s = scene();
    s["media"]["fog"] = json!({ "plugin": build::unruly("phase") });
    let wrong = "is a plugin of the kind phase where one of the kind medium is needed";
    says(&fault(&s).text, &["$.media.fog", wrong]);
    let mut s = scene();
    s["materials"]["paint"] = json!({ "plugin": "homogeneous" });
    s["shapes"] =
        json!([{ "type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "paint" }]);
    says(
        &fault(&s).text,
        &["$.materials.paint", "there is no bsdf plugin 'homogeneous'"],
    );
}

/// Of two plugins of one name, the first in the search path is taken, also if it is broken: silently taking another would hide
/// which one rendered the picture.
#[test]
fn the_first_in_the_search_path_wins() {
    let place = |name: &str, definitions: &[&str]| {
        let library = c_phase(&format!("two_{name}"), definitions);
        let path = folder("two").join(name);
        std::fs::create_dir_all(&path).unwrap_or_else(|e| panic!("{e}"));
        let to = path.join(library_name("resolvent_phase_linear"));
        std::fs::copy(&library, to).unwrap_or_else(|e| panic!("{e}"));
        path
    };
    let (one, two) = (place("one", &[]), place("two", &[]));
    let broken = place("broken", &["ABI_MAJOR=2"]);
    let found = |first: &[PathBuf]| {
        let plugin = registry_before(first).find(PluginKind::Phase, "linear");
        plugin.map(|p| p.path.clone()).map_err(|e| e.to_string())
    };
    let library = library_name("resolvent_phase_linear");
    assert_eq!(found(&[one.clone(), two.clone()]), Ok(one.join(&library)));
    assert_eq!(found(&[two.clone(), one.clone()]), Ok(two.join(&library)));
    assert_eq!(
        found(&[folder("nothing"), one.clone()]),
        Ok(one.join(&library))
    );
    let why = found(&[broken.clone(), one.clone()]).unwrap_err();
    says(
        &why,
        &[&broken.display().to_string(), "was built for plugin ABI 2."],
    );
    let listed: Vec<_> = registry_before(&[two.clone(), one.clone(), broken])
        .available()
        .into_iter()
        .filter(|(kind, name, _)| *kind == PluginKind::Phase && name == "linear")
        .map(|(.., path)| path)
        .collect();
    assert_eq!(listed, [two.join(&library)]);
    // Those that are never used are known.
    let found = registry_before(&[two.clone(), one.clone(), two.clone()]).found();
    let linear = found.iter().find(|f| f.name == "linear");
    assert_eq!(
        linear.map(|f| &f.hides[..]),
        Some(&[one.join(&library)][..])
    );
}

/// A name that is nowhere: the nearest, all that are known, and where they were sought.
#[test]
fn an_unknown_name() {
    let mut s = scene();
    s["media"]["fog"] = json!({ "plugin": "homogenous" });
    let folder = build::unruly_folder().display().to_string();
    let library = library_name("resolvent_medium_homogenous");
    says(
        &fault(&s).text,
        &[
            "$.media.fog",
            "there is no medium plugin 'homogenous'",
            "did you mean 'homogeneous'?",
            "unruly",
            &format!("Searched for {library} in: {folder}"),
        ],
    );
}
