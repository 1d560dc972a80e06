//! The page as HTML.

use std::fmt::Write;

use super::{Block, Cell, Download, Page, Picture, Section, Strip, Table};

const STYLE: &str = include_str!("page.css");

/// What must not stand in a text of HTML or in an attribute, replaced. Control characters become marks of what cannot be shown.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(letter),
            control if control.is_control() => out.push('\u{fffd}'),
            other => out.push(other),
        }
    }
    out
}

/// The whole page; `size` tells how many bytes a file of it has.
pub(super) fn of(page: &Page, size: &dyn Fn(&str) -> u64) -> String {
    let title = escaped(&page.title);
    let mut out = String::new();
    let _ = write!(
        out,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <!-- Nothing is shown but the files beside this one. -->\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src 'self' data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'\">\n\
         <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n"
    );
    for paragraph in &page.lead {
        let _ = writeln!(out, "<p class=\"lead\">{}</p>", escaped(paragraph));
    }
    out += "</header>\n<main>\n";
    for section in &page.sections {
        write_section(&mut out, section, size);
    }
    let _ = write!(out, "</main>\n<footer><p>{}</p></footer>\n</body>\n</html>\n", escaped(&page.footer));
    out
}

fn write_section(out: &mut String, section: &Section, size: &dyn Fn(&str) -> u64) {
    let _ = writeln!(out, "<section>\n<h2>{}</h2>", escaped(&section.title));
    for (place, block) in section.blocks.iter().enumerate() {
        // Tables that follow each other stand side by side where there is room.
        let is_table = |place: Option<usize>| {
            place.and_then(|place| section.blocks.get(place)).is_some_and(|block| matches!(block, Block::Table(_)))
        };
        if is_table(Some(place)) && !is_table(place.checked_sub(1)) {
            out.push_str("<div class=\"tables\">\n");
        }
        match block {
            Block::Text(text) => {
                let _ = writeln!(out, "<p>{}</p>", escaped(text));
            }
            Block::Strip(strip) => write_strip(out, strip),
            Block::Plots(plots) => {
                out.push_str("<div class=\"plots\">\n");
                plots.iter().for_each(|plot| write_picture(out, plot, "plot"));
                out.push_str("</div>\n");
            }
            Block::Table(table) => write_table(out, table),
            Block::Downloads(downloads) => write_downloads(out, downloads, size),
        }
        if is_table(Some(place)) && !is_table(Some(place + 1)) {
            out.push_str("</div>\n");
        }
    }
    out.push_str("</section>\n");
}

fn write_strip(out: &mut String, Strip { pictures, legend, caption }: &Strip) {
    let mut columns = format!("repeat({},minmax(0,1fr))", pictures.len().max(1));
    if let (Some(legend), Some(first)) = (legend, pictures.first()) {
        // As wide as makes it as high as the pictures.
        let shape = |picture: &Picture| picture.size[0] as f64 / picture.size[1].max(1) as f64;
        let _ = write!(columns, " minmax(0,{:.4}fr)", shape(legend) / shape(first).max(1e-3));
    }
    let _ = writeln!(out, "<figure class=\"strip\">\n<div class=\"row\" style=\"--columns:{columns}\">");
    pictures.iter().for_each(|picture| write_picture(out, picture, "picture"));
    legend.iter().for_each(|legend| write_picture(out, legend, "picture legend"));
    out.push_str("</div>\n");
    if !caption.is_empty() {
        let _ = writeln!(out, "<figcaption>{}</figcaption>", escaped(caption));
    }
    out.push_str("</figure>\n");
}

fn write_picture(out: &mut String, picture: &Picture, class: &str) {
    let [width, height] = picture.size;
    let _ = write!(
        out,
        "<figure class=\"{class}\"><img src=\"{}\" width=\"{width}\" height=\"{height}\" alt=\"{}\">",
        escaped(&picture.file.name),
        escaped(&picture.alt)
    );
    if !picture.caption.is_empty() {
        let _ = write!(out, "<figcaption>{}</figcaption>", escaped(&picture.caption));
    }
    out.push_str("</figure>\n");
}

fn write_table(out: &mut String, table: &Table) {
    out.push_str("<div class=\"table\"><table>\n");
    if !table.caption.is_empty() {
        let _ = writeln!(out, "<caption>{}</caption>", escaped(&table.caption));
    }
    if !table.head.is_empty() {
        out.push_str("<thead><tr>");
        for name in &table.head {
            let _ = write!(out, "<th scope=\"col\">{}</th>", escaped(name));
        }
        out.push_str("</tr></thead>\n");
    }
    out.push_str("<tbody>\n");
    for row in &table.rows {
        out.push_str("<tr>");
        for (column, Cell { text, figure }) in row.iter().enumerate() {
            let text = escaped(text);
            let _ = match (column, figure) {
                (0, _) => write!(out, "<th scope=\"row\">{text}</th>"),
                (_, Some(figure)) => write!(out, "<td data-figure=\"{}\">{text}</td>", escaped(figure)),
                (_, None) => write!(out, "<td>{text}</td>"),
            };
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table></div>\n");
}

fn write_downloads(out: &mut String, downloads: &[Download], size: &dyn Fn(&str) -> u64) {
    out.push_str("<ul class=\"downloads\">\n");
    for Download { file, text } in downloads {
        let name = escaped(&file.name);
        let short = name.rsplit('/').next().unwrap_or(&name);
        let _ = writeln!(
            out,
            "<li><a href=\"{name}\" download>{short}</a> <span>{}, {}</span></li>",
            escaped(text),
            bytes(size(&file.name))
        );
    }
    out.push_str("</ul>\n");
}

/// A size of so many bytes in the largest unit in which it is at least one, such as `16.9 MB`.
pub fn bytes(size: u64) -> String {
    match size {
        0..1_000 => format!("{size} B"),
        1_000..1_000_000 => format!("{} kB", size.div_ceil(1_000)),
        _ => format!("{:.1} MB", size as f64 / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::page::File;

    #[test]
    fn every_text_is_escaped() {
        let bad = || "<script>\"&'\u{7}".to_owned();
        let file = File::new("a.png", Vec::new());
        let picture = || Picture { file: file.clone(), size: [4, 3], alt: bad(), caption: bad() };
        let cell = Cell { text: bad(), figure: Some(bad()) };
        let table = Table { caption: bad(), head: vec![bad()], rows: vec![vec![bad().into(), cell, bad().into()]] };
        let blocks = vec![
            Block::Text(bad()),
            Block::Strip(Strip { pictures: vec![picture()], legend: Some(picture()), caption: bad() }),
            Block::Plots(vec![picture()]),
            Block::Table(table),
            Block::Downloads(vec![Download { file: file.clone(), text: bad() }]),
        ];
        let sections = vec![Section { title: bad(), blocks }];
        let page = Page { title: bad(), lead: vec![bad()], sections, footer: bad(), files: Vec::new() };
        let html = of(&page, &|_| 1234);
        assert!(!html.contains("<script") && !html.contains('\u{7}'), "{html}");
        assert_eq!(html.matches("&lt;script&gt;&quot;&amp;&#39;\u{fffd}").count(), 20);
        assert!(html.contains("2 kB"));
    }

    #[test]
    fn tables_that_follow_each_other_stand_together() {
        let (text, table) = (Block::Text("a".into()), Block::Table(Table::default()));
        let blocks = vec![table.clone(), table.clone(), text, table];
        let page = Page { sections: vec![Section { title: "b".into(), blocks }], ..Page::default() };
        let html = of(&page, &|_| 0);
        let (body, tables) = (&html[html.find("<body>").unwrap()..], "<div class=\"tables\">");
        assert_eq!((body.matches(tables).count(), body.matches("<table>").count()), (2, 3));
        assert_eq!(body.matches("<div").count(), body.matches("</div>").count());
    }

    #[test]
    fn sizes_are_told_in_units_that_fit() {
        assert_eq!([0, 999, 1000, 999_001, 12_340_000].map(bytes), ["0 B", "999 B", "1 kB", "1000 kB", "12.3 MB"]);
    }
}
