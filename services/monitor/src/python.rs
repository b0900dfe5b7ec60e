//! `topic schema --python`: the table of topics as Python modules, for `bus/python`.
//!
//! The module has a ctypes class and a numpy dtype for each payload; the stub file has their types.
//! Both files are in the repository, because an installed package has no `lager` beside it. The
//! dtypes take their offsets from Rust and the classes from ctypes, so a test can compare the two.

use std::collections::BTreeSet;
use std::fmt::{self, Write};
use std::io;
use std::path::Path;

use lager_sample::{FieldInfo, Make, Stamp, StructInfo};
use lager_topics::TOPICS;

/// The command that makes both files again.
const COMMAND: &str = "lager topic schema --python bus/python/lagerrobot";

/// Writes `layouts.py` and `layouts.pyi` into `folder`, which must exist.
///
/// # Errors
/// A file cannot be written.
pub fn write_python(folder: &Path) -> io::Result<()> {
    let [module, stub] = python();
    std::fs::write(folder.join("layouts.py"), module)?;
    std::fs::write(folder.join("layouts.pyi"), stub)
}

/// The module and its stub.
fn python() -> [String; 2] {
    let mut types = Types::default();
    types.add(StructInfo::of::<Stamp>());
    for entry in TOPICS {
        types.add(entry.layout);
    }
    [module(&types), stub(&types)].map(|text| text.expect("a string takes everything"))
}

/// Every type of the table once, after the types that it contains.
#[derive(Default)]
struct Types {
    enums: Vec<(&'static str, &'static [(u8, &'static str)])>,
    structs: Vec<StructInfo>,
    seen: BTreeSet<&'static str>,
}

impl Types {
    fn add(&mut self, info: StructInfo) {
        if !self.seen.insert(info.type_name) {
            return;
        }
        for field in info.fields {
            self.visit(&field.make);
        }
        self.structs.push(info);
    }

    fn visit(&mut self, kind: &Make) {
        match *kind {
            Make::Number(_) => {}
            Make::Tag { name, variants } => {
                if self.seen.insert(name) {
                    self.enums.push((name, variants));
                }
            }
            Make::List(of, _) => self.visit(of),
            Make::Record(info) => self.add(info),
        }
    }
}

fn module(types: &Types) -> Result<String, fmt::Error> {
    let mut out = format!(
        "\"\"\"The topics' layouts. Made by `{COMMAND}`.\"\"\"\n\n\
         import ctypes\nimport enum\n\nfrom ._layout import Layout, Qos, TopicEntry\n\n"
    );
    for (name, variants) in &types.enums {
        writeln!(out, "\nclass {name}(enum.IntEnum):")?;
        for (code, variant) in *variants {
            writeln!(out, "    {} = {code}", word(variant))?;
        }
        out.push('\n');
    }
    for info in &types.structs {
        writeln!(out, "\nclass {}(Layout):", info.name())?;
        writeln!(out, "    _type_name_ = \"{}\"", info.type_name)?;
        writeln!(out, "    _hash_ = 0x{:016X}", info.hash)?;
        out.push_str("    _fields_ = [\n");
        for field in info.fields {
            writeln!(
                out,
                "        (\"{}\", {}),",
                word(field.name),
                ctype(&field.make)
            )?;
        }
        out.push_str("    ]\n    _enums_ = {");
        out.push_str(&listed(info.fields, |field| match field.make {
            Make::Tag { name, .. } => Some(format!("\"{}\": {name}", word(field.name))),
            _ => None,
        }));
        out.push_str("}\n    _dtype_ = {\n");
        let fields = info.fields;
        let names = listed(fields, |field| Some(format!("\"{}\"", word(field.name))));
        let formats = listed(fields, |field| Some(format(&field.make)));
        let offsets = listed(fields, |field| Some(field.offset.to_string()));
        writeln!(out, "        \"names\": [{names}],")?;
        writeln!(out, "        \"formats\": [{formats}],")?;
        writeln!(out, "        \"offsets\": [{offsets}],")?;
        writeln!(out, "        \"itemsize\": {},\n    }}\n", info.size)?;
    }
    out.push_str("\nTOPICS = {\n");
    for entry in TOPICS {
        let qos = entry.qos;
        writeln!(out, "    \"{}\": TopicEntry(", entry.name)?;
        writeln!(out, "        \"{}\",", entry.name)?;
        writeln!(out, "        {},", entry.layout.name())?;
        writeln!(
            out,
            "        Qos({}, {}, {}, {}, {}),",
            qos.buffer,
            qos.history,
            qos.max_publishers(),
            qos.max_subscribers(),
            qos.max_nodes()
        )?;
        writeln!(out, "        \"{}\",\n    ),", entry.summary)?;
    }
    out.push_str(
        "}\n\n\nclass ByName:\n    def topic(self, name):\n        return self._open(name)\n",
    );
    Ok(out)
}

fn stub(types: &Types) -> Result<String, fmt::Error> {
    let mut out = format!(
        "# The types of the topics' layouts. Made by `{COMMAND}`.\n\n\
         import enum\nfrom typing import Any, Literal, Sequence, overload\n\n\
         from ._layout import Layout, TopicEntry\nfrom ._reader import Reader\n\n"
    );
    for (name, variants) in &types.enums {
        writeln!(out, "class {name}(enum.IntEnum):")?;
        for (code, variant) in *variants {
            writeln!(out, "    {} = {code}", word(variant))?;
        }
        out.push('\n');
    }
    for info in &types.structs {
        writeln!(out, "class {}(Layout):", info.name())?;
        for field in info.fields {
            writeln!(out, "    {}: {}", word(field.name), hint(&field.make))?;
        }
        out.push('\n');
    }
    out.push_str("TOPICS: dict[str, TopicEntry]\n\nclass ByName:\n");
    for entry in TOPICS {
        let class = entry.layout.name();
        writeln!(out, "    @overload")?;
        writeln!(
            out,
            "    def topic(self, name: Literal[\"{}\"]) -> Reader[{class}]: ...",
            entry.name
        )?;
    }
    out.push_str("    @overload\n    def topic(self, name: str) -> Reader[Any]: ...\n");
    out.push_str("    def _open(self, name: str) -> Reader[Any]: ...\n");
    Ok(out)
}

fn listed(fields: &[FieldInfo], each: impl Fn(&FieldInfo) -> Option<String>) -> String {
    fields
        .iter()
        .filter_map(each)
        .collect::<Vec<_>>()
        .join(", ")
}

/// A name that is not a word of Python: `from_` for `from`, as Python's own libraries write it.
fn word(name: &str) -> String {
    const KEYWORDS: [&str; 35] = [
        "False", "None", "True", "and", "as", "assert", "async", "await", "break", "class",
        "continue", "def", "del", "elif", "else", "except", "finally", "for", "from", "global",
        "if", "import", "in", "is", "lambda", "nonlocal", "not", "or", "pass", "raise", "return",
        "try", "while", "with", "yield",
    ];
    let tail = if KEYWORDS.contains(&name) { "_" } else { "" };
    format!("{name}{tail}")
}

fn ctype(kind: &Make) -> String {
    match kind {
        Make::Number("f32") => "ctypes.c_float".to_owned(),
        Make::Number("f64") => "ctypes.c_double".to_owned(),
        Make::Number(name) => {
            let sign = if name.starts_with('u') { "u" } else { "" };
            format!("ctypes.c_{sign}int{}", &name[1..])
        }
        Make::Tag { .. } => "ctypes.c_uint8".to_owned(),
        Make::List(of, length) => format!("{} * {length}", ctype(of)),
        Make::Record(info) => info.name().to_owned(),
    }
}

/// The format of a numpy dtype, little end first as on every machine that the bus runs on.
fn format(kind: &Make) -> String {
    match kind {
        Make::Number(name) => {
            let bits: usize = name[1..].parse().expect("a number's name ends in its bits");
            format!("\"<{}{}\"", &name[..1], bits / 8)
        }
        Make::Tag { .. } => "\"<u1\"".to_owned(),
        Make::List(of, length) => format!("({}, ({length},))", format(of)),
        Make::Record(info) => format!("{}._dtype_", info.name()),
    }
}

fn hint(kind: &Make) -> String {
    match kind {
        Make::Number("f32" | "f64") => "float".to_owned(),
        Make::Number(_) | Make::Tag { .. } => "int".to_owned(),
        Make::List(of, _) => format!("Sequence[{}]", hint(of)),
        Make::Record(info) => info.name().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_python_package_has_the_layouts_of_this_table() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../bus/python/lagerrobot");
        for (name, made) in ["layouts.py", "layouts.pyi"].into_iter().zip(python()) {
            let kept = std::fs::read_to_string(Path::new(folder).join(name)).unwrap();
            assert!(
                kept == made,
                "{name} is stale; run `cargo run --release -- topic schema --python bus/python/lagerrobot`"
            );
        }
    }
}
