//! The table of runs as Parquet, for pandas, DuckDB and the like.

use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};

use super::plan::Plan;
use super::setting::shown;
use super::store::{Run, columns};
use crate::folder::write;

/// A column with its values.
enum Column {
    Number(Vec<Option<f64>>),
    Count(Vec<i64>),
    Text(Vec<ByteArray>),
}

impl Column {
    fn is_empty(&self) -> bool {
        matches!(self, Column::Number(values) if values.iter().all(Option::is_none))
    }
}

/// Writes the runs of a sweep.
///
/// # Errors
/// The file and the reason.
pub(super) fn write_parquet(path: &Path, plan: &Plan, runs: &[Run]) -> std::result::Result<(), String> {
    let bytes = table(plan, runs).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    write(path, &bytes)
}

fn table(plan: &Plan, runs: &[Run]) -> Result<Vec<u8>> {
    let names = columns(plan);
    let columns = contents(plan, runs);
    let fields = names.iter().zip(&columns).map(|(name, column)| {
        let (physical, repetition, logical) = match column {
            Column::Number(_) => (Physical::DOUBLE, Repetition::OPTIONAL, None),
            Column::Count(_) => (Physical::INT64, Repetition::REQUIRED, None),
            Column::Text(_) => (Physical::BYTE_ARRAY, Repetition::REQUIRED, Some(LogicalType::String)),
        };
        let field = Type::primitive_type_builder(name, physical).with_repetition(repetition);
        field.with_logical_type(logical).build().map(Arc::new)
    });
    let schema = Type::group_type_builder("runs").with_fields(fields.collect::<Result<_>>()?).build()?;
    // A column without a single value needs no dictionary, and fastparquet cannot read an empty one.
    let empty = names.iter().zip(&columns).filter(|(_, column)| column.is_empty());
    let properties = empty.fold(WriterProperties::builder(), |properties, (name, _)| {
        properties.set_column_dictionary_enabled(ColumnPath::from(name.as_str()), false)
    });
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties.build()))?;
    let mut group = writer.next_row_group()?;
    for column in &columns {
        let Some(mut into) = group.next_column()? else { break };
        match column {
            Column::Number(values) => {
                let present: Vec<f64> = values.iter().copied().flatten().collect();
                let defined: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
                into.typed::<DoubleType>().write_batch(&present, Some(&defined), None)?;
            }
            Column::Count(values) => {
                into.typed::<Int64Type>().write_batch(values, None, None)?;
            }
            Column::Text(values) => {
                into.typed::<ByteArrayType>().write_batch(values, None, None)?;
            }
        }
        into.close()?;
    }
    group.close()?;
    writer.into_inner()
}

/// The columns: swept keys, as numbers where all of their values are; repeat, seed and outcome; the measures.
fn contents(plan: &Plan, runs: &[Run]) -> Vec<Column> {
    let mut columns = Vec::new();
    for (index, setting) in plan.settings.iter().enumerate() {
        let values = || runs.iter().map(|run| &plan.cells[run.cell].values[index]);
        columns.push(if setting.values.iter().all(|value| number(value).is_some()) {
            Column::Number(values().map(number).collect())
        } else {
            Column::Text(values().map(|value| text(&shown(value))).collect())
        });
    }
    columns.push(Column::Count(runs.iter().map(|run| i64::from(run.repeat)).collect()));
    columns.push(Column::Count(runs.iter().map(|run| plan.seed(run.cell, run.repeat).cast_signed()).collect()));
    columns.push(Column::Text(runs.iter().map(|run| text(&run.outcome)).collect()));
    let measures = runs.first().map_or(super::measure::MEASURES.len(), |run| run.numbers.len());
    columns.extend((0..measures).map(|index| Column::Number(runs.iter().map(|run| run.numbers[index]).collect())));
    columns
}

fn text(text: &str) -> ByteArray {
    ByteArray::from(text)
}

/// A value as a number, if it is one.
pub(super) fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|integer| integer as f64))
}

#[cfg(test)]
mod tests {
    use common::mission::Mission;
    use parquet::file::reader::{FileReader, SerializedFileReader};

    use super::*;
    use crate::sweep::measure::MEASURES;
    use crate::sweep::setting::Setting;

    #[test]
    fn a_column_without_values_has_no_dictionary_for_readers_to_stumble_over() {
        let text = include_str!("../../../missions/thesis/fig-1-9.toml");
        let mission = Arc::new(Mission::parse("m", text).expect("sound"));
        let settings = vec![Setting::parse("network.loss=0,0.5").expect("a setting")];
        let plan = Plan::new("m", mission, settings, 2).expect("sound");
        // The first measure has a value in one run, the second in none.
        let numbers = |cell: usize| (0..MEASURES.len()).map(move |index| (index != 1 && cell == 0).then_some(2.5));
        let run = |cell: usize| Run { cell, repeat: 0, outcome: "finished".into(), numbers: numbers(cell).collect() };
        let bytes = table(&plan, &[run(0), run(1)]).expect("a table");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("runs.parquet");
        std::fs::write(&path, bytes).expect("written");
        let reader = SerializedFileReader::new(std::fs::File::open(path).expect("there")).expect("Parquet");
        let group = reader.metadata().row_group(0);
        let has_dictionary = |name: &str| {
            let column = group.columns().iter().find(|column| column.column_path().string() == name).expect("a column");
            column.dictionary_page_offset().is_some()
        };
        assert!(has_dictionary("network.loss.bernoulli.probability") && has_dictionary(MEASURES[0].name));
        assert!(!has_dictionary(MEASURES[1].name));
        let rows: Vec<String> =
            reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row").to_string()).collect();
        let second = format!("{}: null", MEASURES[1].name);
        assert!(rows.len() == 2 && rows.iter().all(|row| row.contains(&second)), "{rows:?}");
        assert!(rows[0].contains(&format!("{}: 2.5", MEASURES[0].name)), "{rows:?}");
    }
}
