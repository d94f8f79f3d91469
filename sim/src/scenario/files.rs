//! Files that a scenario names, in its folder or stored with it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::error::Error;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use ::record::with_commas;
use geojson::{GeoJson, Geometry, GeometryValue, Position};

use crate::{record::Origin, world::water::CurrentGrid};

/// Largest size of a GeoJSON file, bytes.
const GEOJSON_BYTES_MAX: u64 = 10_000_000;

/// Byte order mark that some tools write before the text.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Largest size of a grid of currents, bytes: a million nodes of five long numbers.
const GRID_BYTES_MAX: u64 = 100_000_000;

/// The location of a scenario's other files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Files(Location);

#[derive(Clone, Debug, Default, PartialEq)]
enum Location {
    #[default]
    Nowhere,
    Folder(PathBuf),
    /// Texts by name.
    Memory(Arc<BTreeMap<String, String>>),
}

/// Reason why a file that a scenario names cannot be used, in words.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct UnreadableFile(String);

impl Files {
    /// The files in `folder`.
    pub fn beside(folder: &Path) -> Self {
        Self(Location::Folder(folder.to_owned()))
    }

    /// Stored `texts`, by name, of a scenario that was moved.
    pub fn kept(texts: BTreeMap<String, String>) -> Self {
        Self(Location::Memory(Arc::new(texts)))
    }

    /// The text of the file called `name`, for [`Self::kept`].
    pub(super) fn text(&self, name: &str) -> Result<String, UnreadableFile> {
        let (bytes, path) = self.bytes(name, GRID_BYTES_MAX)?;
        String::from_utf8(bytes.into_owned()).map_err(|error| cannot_read(&path, &error))
    }

    /// The grid of currents in the file called `name`.
    pub(super) fn grid(&self, name: &str) -> Result<Arc<CurrentGrid>, UnreadableFile> {
        let (bytes, path) = self.bytes(name, GRID_BYTES_MAX)?;
        let grid = CurrentGrid::read(&*with_commas(&bytes));
        grid.map(Arc::new).map_err(|error| UnreadableFile(format!("{path}: {error}")))
    }

    /// The points of the only line in the GeoJSON file called `name`: a `LineString`, or the parts
    /// of a `MultiLineString` in order. Points that tools repeat between parts count once.
    pub(super) fn line(&self, name: &str) -> Result<Vec<Origin>, UnreadableFile> {
        let (bytes, path) = self.bytes(name, GEOJSON_BYTES_MAX)?;
        let geojson = GeoJson::from_reader(bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&bytes))
            .map_err(|error| UnreadableFile(format!("{path} is not GeoJSON: {error}")))?;
        let lines = lines(&geojson);
        let [line] = &lines[..] else {
            let says = format!("{path} has {} LineStrings instead of one; join them", lines.len());
            return Err(UnreadableFile(says));
        };
        let place = |(index, position): (usize, &&Position)| {
            let [longitude, latitude, ..] = position.as_slice() else {
                let says = format!("{path}: position {index} of the line has no longitude and latitude");
                return Err(UnreadableFile(says));
            };
            Ok(Origin { latitude: latitude.to_radians(), longitude: longitude.to_radians() })
        };
        let mut points: Vec<_> = line.iter().enumerate().map(place).collect::<Result<_, _>>()?;
        points.dedup();
        Ok(points)
    }

    /// The content of the file called `name`, and its path. Links out of the folder are refused.
    fn bytes(&self, name: &str, bytes_max: u64) -> Result<(Cow<'_, [u8]>, String), UnreadableFile> {
        let folder = match &self.0 {
            Location::Nowhere => {
                let says = format!("{name:?} cannot be found: the scenario was not read from a folder");
                return Err(UnreadableFile(says));
            }
            Location::Memory(texts) => {
                let text = texts.get(name);
                let text =
                    text.ok_or_else(|| UnreadableFile(format!("{name:?} was not stored with the scenario")))?;
                return Ok((Cow::Borrowed(text.as_bytes()), name.to_owned()));
            }
            Location::Folder(folder) => folder,
        };
        let path = folder.join(name);
        let shown = path.display().to_string();
        let unreadable = |error: io::Error| cannot_read(&shown, &error);
        let elsewhere = || {
            let says = format!("{name:?} is not in the scenario's folder; give the name of a file there");
            Err(UnreadableFile(says))
        };
        let inside = Path::new(name).components().all(|component| matches!(component, Component::Normal(_)));
        if name.is_empty() || !inside {
            return elsewhere();
        }
        // An empty path is the current folder.
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let (real, home) = (path.canonicalize(), folder.canonicalize());
        let real = real.map_err(unreadable)?;
        if !real.starts_with(home.map_err(unreadable)?) {
            return elsewhere();
        }
        let bytes = read(&real, bytes_max).map_err(unreadable)?;
        Ok((Cow::Owned(bytes), shown))
    }
}

fn cannot_read(path: &str, error: &dyn Error) -> UnreadableFile {
    UnreadableFile(format!("cannot read {path}: {error}"))
}

/// The content of the regular file at `path`: a pipe or device may have no end.
pub(super) fn read(path: &Path, bytes_max: u64) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    let mut bytes = vec![];
    File::open(path)?.take(bytes_max + 1).read_to_end(&mut bytes)?;
    if usize::try_from(bytes_max).is_ok_and(|most| most < bytes.len()) {
        return Err(io::Error::other(format!("it has more than {bytes_max} bytes")));
    }
    Ok(bytes)
}

/// The lines of a file, each with the positions of all its parts.
fn lines(geojson: &GeoJson) -> Vec<Vec<&Position>> {
    let geometries: Vec<&Geometry> = match geojson {
        GeoJson::Geometry(geometry) => vec![geometry],
        GeoJson::Feature(feature) => feature.geometry.iter().collect(),
        GeoJson::FeatureCollection(collection) => {
            let features = collection.features.iter();
            features.filter_map(|feature| feature.geometry.as_ref()).collect()
        }
    };
    let lines = geometries.into_iter().filter_map(|geometry| match &geometry.value {
        GeometryValue::LineString { coordinates } => Some(coordinates.iter().collect()),
        GeometryValue::MultiLineString { coordinates } => Some(coordinates.iter().flatten().collect()),
        _ => None,
    });
    lines.collect()
}
