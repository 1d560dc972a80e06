//! The page of a fit: scan, fit and their distance, landmarks by name, weights in standard deviations, files.

use habitus_core::format::{Mode, Model};
use serde_json::{Value, json};

use super::colour_bar::ColourBar;
use super::fit_shown::FitShown;
use super::page::{Block, Cell, Download, File, Page, Picture, Section, Strip, Table};
use super::plot::{Bars, Cumulative, Histogram, Sample};
use super::portrait::{LINING, Portraits};
use super::view::View;
use crate::Error;
use crate::generate::deviations_of_weights;
use crate::mesh::Mesh;
use crate::register::scan_fit::{ScanFit, ScanFitOptions};

/// Files of the page that could also be an input or another output.
pub const PAGE_FILES: [&str; 4] = ["index.html", "fit.glb", "scan.glb", "figures.json"];

/// What is told about.
#[derive(Debug, Clone, Copy)]
pub struct FitReport<'a> {
    /// The model.
    pub model: &'a Model<'a>,
    /// Its file.
    pub model_name: &'a str,
    /// What was fitted to, in its unit and frame.
    pub scan: &'a Mesh,
    /// Its file.
    pub scan_name: &'a str,
    /// The fit.
    pub fit: &'a ScanFit,
    /// How it was made.
    pub options: &'a ScanFitOptions,
    /// The fitted model in the unit and frame of the scan.
    pub fitted: &'a Mesh,
    /// Which landmarks were marked, in the order of the model.
    pub marked: &'a [bool],
    /// Figures of the fit, an object; the page adds its own.
    pub figures: &'a Value,
}

impl FitReport<'_> {
    /// The page with its files.
    ///
    /// # Errors
    /// [`Error::Input`] for a scan that is not sound; faults of drawing and writing.
    pub fn page(&self) -> Result<Page, Error> {
        let shown = FitShown::new(self.fit, self.scan, self.fitted)?;
        let figures = self.all_figures(&shown);
        let json = format!("{figures:#}\n").into_bytes();
        let sections = vec![
            pictures(&shown)?,
            self.distances(&shown, &figures)?,
            self.landmarks(&figures),
            self.weights(&figures)?,
            self.downloads(json)?,
        ];
        Ok(Page {
            title: format!("{} fitted to {}", self.model_name, self.scan_name),
            lead: vec![format!(
                "Half of the fitted model's vertices that have a counterpart in the scan are within {:.2} mm of it; {:.0} % of the model's area lies on the scan.",
                shown.quantile(0.5),
                100.0 * self.fit.coverage
            )],
            sections,
            footer: super::made_by(),
            files: Vec::new(),
        })
    }

    fn all_figures(&self, shown: &FitShown) -> Value {
        let mut figures = self.figures.clone();
        if let Some(object) = figures.as_object_mut() {
            let n = shown.sorted.len();
            object.insert("rounds".into(), self.rounds().into());
            object.insert("vertices".into(), shown.distances.len().into());
            object.insert("vertices_on_scan".into(), n.into());
            object.insert("distance_mean_mm".into(), json!(shown.sorted.iter().sum::<f64>() / n.max(1) as f64));
            object.insert("distance_median_mm".into(), json!(shown.quantile(0.5)));
            object.insert("distance_95_mm".into(), json!(shown.quantile(0.95)));
        }
        figures
    }

    fn rounds(&self) -> usize {
        self.options.n_rounds + if self.options.displacement > 0.0 { self.options.n_fine } else { 0 }
    }

    fn distances(&self, shown: &FitShown, figures: &Value) -> Result<Section, Error> {
        let row =
            |name: &str, pointer: &str, decimals: usize| vec![name.into(), Cell::figure(figures, pointer, decimals)];
        let table = Table {
            caption: "Distances in mm. A vertex counts as on the scan when its closest point is not on the boundary of the scan.".into(),
            head: Vec::new(),
            rows: vec![
                row("vertices of the model", "vertices", 0),
                row("of these on the scan", "vertices_on_scan", 0),
                row("their distance from the scan, mean", "distance_mean_mm", 3),
                row("median", "distance_median_mm", 3),
                row("95 % within", "distance_95_mm", 3),
                row("median along the normals, of the pairs of the last round", "median_mm", 3),
                row("robust standard deviation of these", "sigma_mm", 3),
                row("share of the model's area that has a partner, %", "coverage_percent", 1),
                row("points of the scan that took part", "points", 0),
                row("rounds", "rounds", 0),
            ],
        };
        let (x, counted) = ("distance from the scan, mm".to_owned(), "vertices".to_owned());
        let samples = vec![Sample { name: "fit".into(), values: shown.sorted.clone() }];
        let histogram = Histogram { x: x.clone(), counted: counted.clone(), samples: samples.clone() };
        let cumulative = Cumulative { x, counted, samples };
        let plots = vec![
            Picture::plot(
                histogram.svg()?,
                "plots/distances.svg",
                "Histogram of the distances of the fit's vertices from the scan",
                "How the distances are spread. The axis ends where 99 % are within it.",
            ),
            Picture::plot(
                cumulative.svg()?,
                "plots/within.svg",
                "Share of the fit's vertices within each distance from the scan",
                "Which share of the vertices is within which distance.",
            ),
        ];
        Ok(Section { title: "Distances".into(), blocks: vec![Block::Plots(plots), Block::Table(table)] })
    }

    /// The marked landmarks with their distances.
    fn landmarks(&self, figures: &Value) -> Section {
        let row = |(place, name): (usize, &String)| {
            vec![name.clone().into(), Cell::figure(figures, &format!("landmark_residuals_mm/{place}"), 2)]
        };
        let names = marked_names(self.model, self.marked);
        let unmarked = self.marked.iter().filter(|marked| !**marked).count();
        let mut blocks = vec![Block::Table(Table {
            caption: "How far each landmark is from that of the fitted model.".into(),
            head: vec!["landmark".into(), "distance, mm".into()],
            rows: names.iter().enumerate().map(row).collect(),
        })];
        if unmarked > 0 {
            blocks.push(Block::Text(format!("Landmarks of the model that were not marked: {unmarked}.")));
        }
        Section { title: "Landmarks".into(), blocks }
    }

    fn weights(&self, figures: &Value) -> Result<Section, Error> {
        let (model, fit) = (self.model, self.fit);
        let mut plots = Vec::new();
        let modes = [(Mode::Identity, "identity", &fit.identity), (Mode::Pose, "expression", &fit.pose)];
        for (mode, name, weights) in modes {
            let Some(values) = deviations_of_weights(model, mode, weights) else { continue };
            let bars = Bars { x: format!("{name} weight"), y: "standard deviations".into(), values, least_reach: 3.0 };
            plots.push(Picture::plot(
                bars.svg()?,
                format!("plots/{name}.svg"),
                format!("The {name} weights in standard deviations of the training data"),
                format!("The {name} weights, in standard deviations of the training data from their means."),
            ));
        }
        let list = |pointer: &str| {
            let numbers = figures.pointer(pointer).and_then(Value::as_array);
            numbers.map_or(String::new(), |all| {
                let shown = all.iter().filter_map(Value::as_f64).map(|number| format!("{number:.2}"));
                shown.collect::<Vec<_>>().join(", ")
            })
        };
        let text =
            format!("Identity: {}. Expression: {}.", list("/identity_deviations"), list("/expression_deviations"));
        Ok(Section { title: "Weights".into(), blocks: vec![Block::Plots(plots), Block::Text(text)] })
    }

    fn downloads(&self, json: Vec<u8>) -> Result<Section, Error> {
        let mm = self.fit.unit.millimetres();
        let glb = |name: &str, mesh: &Mesh| {
            let mut mesh = mesh.clone();
            mesh.positions.iter_mut().flatten().for_each(|x| *x *= mm);
            File::glb(name, &mesh)
        };
        let download = |file: File, text: &str| Download { file, text: text.into() };
        let files = vec![
            download(glb("fit.glb", self.fitted)?, "the fitted model, in the frame of the scan"),
            download(glb("scan.glb", self.scan)?, "the scan"),
            download(File::new("figures.json", json), "weights, placement and all figures"),
        ];
        Ok(Section { title: "Files".into(), blocks: vec![Block::Downloads(files)] })
    }
}

/// The names of the marked landmarks; numbers from 1 where the model names none.
pub fn marked_names(model: &Model<'_>, marked: &[bool]) -> Vec<String> {
    let names: Vec<&str> = model.landmark_names().map(|names| names.iter().collect()).unwrap_or_default();
    let name =
        |place: usize| names.get(place).map_or_else(|| format!("landmark {}", place + 1), |name| (*name).to_owned());
    (0..marked.len()).filter(|&place| marked[place]).map(name).collect()
}

/// Scan, fit and distance from three sides.
fn pictures(shown: &FitShown) -> Result<Section, Error> {
    let colours = shown.colours();
    let bar = ColourBar { missing_label: "no scan".into(), ..shown.bar("mm") };
    let mut blocks = Vec::new();
    let views = &View::NAMED[..3];
    let all = Portraits::holding_views(
        &views.iter().map(|(_, view)| *view).collect::<Vec<_>>(),
        [&shown.fitted],
        Some(LINING),
    );
    for (name, view) in views {
        let cells = Portraits { view: *view, ..all };
        let file = |what: &str| format!("pictures/{}_{what}.png", name.replace([' ', '-'], "_"));
        let alt = |what: &str| format!("{what}, seen from: {name}");
        let picture = |image, what: &str, caption: &str| Picture::of(&image, file(what), alt(caption), caption);
        blocks.push(Block::Strip(Strip {
            pictures: vec![
                picture(cells.clay(&shown.scan), "scan", "scan")?,
                picture(cells.clay(&shown.fitted), "fit", "fit")?,
                picture(cells.coloured(&shown.fitted, &colours), "distance", "distance from the scan, mm")?,
            ],
            legend: Some(
                picture(cells.legend(&bar), "legend", "")
                    .map(|p| Picture { alt: "Legend of the colours, mm".into(), ..p })?,
            ),
            caption: String::new(),
        }));
    }
    Ok(Section { title: "Scan and fit".into(), blocks })
}
