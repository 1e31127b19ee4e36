//! The table of runs as Parquet, for pandas, DuckDB and the like.

use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

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
    let mut writer =
        SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(WriterProperties::builder().build()))?;
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
