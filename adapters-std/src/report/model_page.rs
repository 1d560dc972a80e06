//! The page of a model: how good it is at which size, what its weights do, files.

use habitus_core::format::Model;
use serde_json::Value;

use super::model_sections::{compactness_plot, curve_plots, modes};
use super::page::{Block, Cell, Download, File, Page, Picture, Section, Table};
use crate::Error;
use crate::measure::curves::Curves;

/// What is told about.
#[derive(Debug, Clone, Copy)]
pub struct ModelReport<'a> {
    /// The model whose weights are shown.
    pub model: &'a Model<'a>,
    /// What was measured: its file.
    pub name: &'a str,
    /// Share of the variation that the first weights hold, %, of identity and expression; empty where it is not known.
    pub compactness: [&'a [f64]; 2],
    /// The curves, where they were measured.
    pub curves: Option<&'a Curves>,
    /// All figures, an object as `measure model --json` prints it.
    pub figures: &'a Value,
}

impl ModelReport<'_> {
    /// The page with its files.
    ///
    /// # Errors
    /// [`Error::Input`] for a model without the statistics of its weights; faults of drawing and writing.
    pub fn page(&self) -> Result<Page, Error> {
        let header = self.model.header();
        let mut sections = vec![self.quality()?];
        sections.push(modes(self.model)?);
        let json = File::new("figures.json", format!("{:#}\n", self.figures).into_bytes());
        let files = vec![Download { file: json, text: "every figure of this page".into() }];
        sections.push(Section { title: "Figures".into(), blocks: vec![Block::Downloads(files)] });
        let mut lead = vec![format!(
            "A model of {} vertices with {} identity and {} expression weights.",
            header.n_vertices, header.identity_dim, header.pose_dim
        )];
        lead.extend(
            self.model.provenance().filter(|text| !text.is_empty()).map(|text| format!("Its file says: {text}")),
        );
        Ok(Page {
            title: format!("The model of {}", self.name),
            lead,
            sections,
            footer: super::made_by(),
            files: Vec::new(),
        })
    }

    fn quality(&self) -> Result<Section, Error> {
        let [identity, expression] = self.compactness;
        let mut plots: Vec<Picture> = Vec::new();
        if !(identity.is_empty() && expression.is_empty()) {
            plots.push(compactness_plot(identity, expression)?);
        }
        if let Some(curves) = self.curves {
            plots.extend(curve_plots(&curves.general, &curves.specific)?);
        }
        let mut blocks = vec![Block::Plots(plots)];
        if self.curves.is_none() {
            blocks.push(Block::Text(
                "Generalization and specificity are not shown. They are measured on training data, which a model file does not hold: models of all faces but one \
                 are trained and fitted to that one. For them give the data instead of the file, without --no-curves: habitus measure model TENSOR.npy \
                 --template MESH.ply --report DIR. The error of this model on unseen faces is told with --test DATA."
                    .into(),
            ));
        }
        blocks.extend(self.sizes());
        blocks.extend(self.whole());
        Ok(Section { title: "How good it is".into(), blocks })
    }

    /// The sizes that were trained.
    fn sizes(&self) -> Option<Block> {
        let n = self.figures["sizes"].as_array()?.len();
        let row = |k: usize| {
            let cell = |field: &str, decimals| Cell::figure(self.figures, &format!("sizes/{k}/{field}"), decimals);
            let size = &self.figures["sizes"][k];
            vec![
                format!("{} \u{d7} {}", size["identity_dim"], size["expression_dim"]).into(),
                cell("training_error_mean_mm", 3),
                cell("unseen_error_mean_mm", 3),
                cell("identity_energy_percent", 2),
                cell("expression_energy_percent", 2),
            ]
        };
        let head = [
            "identity \u{d7} expression weights",
            "training error, mm",
            "unseen error, mm",
            "identity variation held, %",
            "expression variation held, %",
        ];
        Some(Block::Table(Table {
            caption: "Mean vertex distance by the size of the model.".into(),
            head: head.map(str::to_owned).to_vec(),
            rows: (0..n).map(row).collect(),
        }))
    }

    /// What is known of a model file.
    fn whole(&self) -> Option<Block> {
        let row =
            |name: &str, pointer: &str, decimals| vec![name.into(), Cell::figure(self.figures, pointer, decimals)];
        self.figures.get("pose_dim")?;
        let mut rows = vec![
            row("variation of identity that the weights hold, %", "identity_energy_percent", 2),
            row("variation of expression that the weights hold, %", "pose_energy_percent", 2),
        ];
        if self.figures.get("unseen_error_mean_mm").is_some() {
            rows.push(row("error on unseen faces, mm", "unseen_error_mean_mm", 3));
            rows.push(row("its standard error, mm", "unseen_error_standard_error_mm", 3));
        }
        Some(Block::Table(Table { rows, ..Table::default() }))
    }
}
