//! The page of a fit: scan, fit and their distance, landmarks by name, weights in standard deviations, files.

use habitus_core::format::{Mode, Model};
use serde_json::Value;

use super::fit_shown::{DISTANCE, FitShown};
use super::page::{Block, Cell, Download, File, Page, Picture, Section, Strip, Table};
use super::plot::{Bars, Cumulative, Histogram, Sample};
use super::portrait::{LINING, Portraits};
use super::view::View;
use crate::Error;
use crate::generate::deviations_of_weights;
use crate::measure::scan_distance::FARTHEST;
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
    /// Both in the frame of the model, with their distance.
    pub shown: &'a FitShown,
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
        let shown = self.shown;
        let figures = self.all_figures();
        let json = format!("{figures:#}\n").into_bytes();
        let sections = vec![
            pictures(shown)?,
            self.distances(&figures)?,
            self.landmarks(&figures),
            self.weights(&figures)?,
            self.downloads(json)?,
        ];
        Ok(Page {
            title: format!("{} fitted to {}", self.model_name, self.scan_name),
            lead: vec![format!(
                "The {DISTANCE} is {} mm in the median; {:.0} % of the model's area lies on the scan. The landmarks are {:.1} mm from those of the fit \
                 on average; about 2 mm is usual.",
                shown.distance.median().map_or("\u{2013}".to_owned(), |median| format!("{median:.2}")),
                100.0 * self.fit.coverage,
                self.fit.landmark_residual
            )],
            sections,
            footer: super::made_by(),
            files: Vec::new(),
        })
    }

    fn all_figures(&self) -> Value {
        let mut figures = self.figures.clone();
        if let Some(object) = figures.as_object_mut() {
            object.insert("rounds".into(), self.rounds().into());
            object.insert("vertices".into(), self.fitted.positions.len().into());
            object.insert("scan_points".into(), self.scan.positions.len().into());
        }
        figures
    }

    fn rounds(&self) -> usize {
        self.options.n_rounds + if self.options.displacement > 0.0 { self.options.n_fine } else { 0 }
    }

    fn distances(&self, figures: &Value) -> Result<Section, Error> {
        let row =
            |name: &str, pointer: &str, decimals: usize| vec![name.into(), Cell::figure(figures, pointer, decimals)];
        let table = Table {
            caption: format!(
                "From each point of the scan to the surface of the fit. A point counts when its closest point is not on the boundary of the fit and at most {FARTHEST} mm away."
            ),
            head: Vec::new(),
            rows: vec![
                row(&format!("{DISTANCE}, median, mm"), "scan_distance_median_mm", 3),
                row("mean, mm", "scan_distance_mean_mm", 3),
                row("95 % within, mm", "scan_distance_95_mm", 3),
                row("points of the scan that count", "points_on_fit", 0),
                row("of all", "scan_points", 0),
            ],
        };
        let how = Table {
            caption: "The fit.".into(),
            head: Vec::new(),
            rows: vec![
                row("vertices of the model", "vertices", 0),
                row("share of the model's area that has a partner in the scan, %", "coverage_percent", 1),
                row("points of the scan that took part", "points", 0),
                row("rounds", "rounds", 0),
                row("scale of the robust loss at the end, mm", "sigma_mm", 3),
            ],
        };
        let (x, counted) = (format!("{DISTANCE}, mm"), "points".to_owned());
        let samples = vec![Sample { name: "fit".into(), values: self.shown.distance.sorted.clone() }];
        let histogram = Histogram { x: x.clone(), counted: counted.clone(), samples: samples.clone() };
        let cumulative = Cumulative { x, counted, samples };
        let plots = vec![
            Picture::plot(
                histogram.svg()?,
                "plots/distances.svg",
                "Histogram of the distances of the scan's points from the fit",
                "How the distances are spread. The axis ends where 99.5 % are within it.",
            ),
            Picture::plot(
                cumulative.svg()?,
                "plots/within.svg",
                "Share of the scan's points within each distance from the fit",
                "Which share of the points is within which distance; the axis as beside.",
            ),
        ];
        Ok(Section {
            title: "Distances".into(),
            blocks: vec![Block::Plots(plots), Block::Table(table), Block::Table(how)],
        })
    }

    /// The marked landmarks with their distances.
    fn landmarks(&self, figures: &Value) -> Section {
        let row = |(place, name): (usize, &String)| {
            vec![name.clone().into(), Cell::figure(figures, &format!("landmark_residuals_mm/{place}"), 2)]
        };
        let names = marked_names(self.model, self.marked);
        let mean = vec!["mean, single far ones counted as 15".into(), Cell::figure(figures, "landmark_residual_mm", 2)];
        let unmarked = self.marked.iter().filter(|marked| !**marked).count();
        let mut blocks = vec![Block::Table(Table {
            caption: "How far each landmark is from that of the fitted model.".into(),
            head: vec!["landmark".into(), "distance, mm".into()],
            rows: names.iter().enumerate().map(row).chain([mean]).collect(),
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
                // Rounded first, for a zero without a sign.
                let rounded = |number: f64| (100.0 * number).round() / 100.0 + 0.0;
                let shown = all.iter().filter_map(Value::as_f64).map(|number| format!("{:.2}", rounded(number)));
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
    let map = shown.map()?;
    let (colours, bar) = (map.colours(), map.bar());
    let mut blocks = Vec::new();
    let views = View::NAMED.map(|(_, view)| view);
    let points: Vec<[f64; 3]> = shown.scan_around().chain(shown.fitted.positions.iter().copied()).collect();
    let all = Portraits::of_views(&views[..3], &points, Some(LINING));
    for ((name, _), cells) in View::NAMED.iter().zip(all) {
        let file = |what: &str| format!("pictures/{}_{what}.png", name.replace([' ', '-'], "_"));
        let alt = |what: &str| format!("{what}, seen from: {name}");
        let picture = |image, what: &str, caption: &str| Picture::of(&image, file(what), alt(caption), caption);
        blocks.push(Block::Strip(Strip {
            pictures: vec![
                picture(cells.clay(&shown.scan), "scan", "scan")?,
                picture(cells.clay(&shown.fitted), "fit", "fit")?,
                picture(cells.coloured(&shown.fitted, &colours), "distance", "distance of the scan on the fit, mm")?,
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
