//! Files that a scenario names: read from the folder it lies in, or kept with it, and nowhere else.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    fs::{self, File},
    io::{self, Read as _},
    path::{Component, Path, PathBuf},
    sync::Arc,
};

use geojson::{GeoJson, Geometry, GeometryValue, Position};

use crate::{
    record::Origin,
    world::water::{CurrentGrid, InvalidGrid},
};

/// Largest GeoJSON file that is read, bytes.
const GEOJSON_BYTES_MAX: u64 = 10_000_000;

/// Largest grid of currents that is read, bytes: a million nodes of five long numbers.
const GRID_BYTES_MAX: u64 = 100_000_000;

/// Where a scenario's other files are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Files(Place);

#[derive(Clone, Debug, Default, PartialEq)]
enum Place {
    #[default]
    Nowhere,
    Folder(PathBuf),
    /// Texts by name.
    Memory(Arc<BTreeMap<String, String>>),
}

/// Why a file that a scenario names is of no use.
#[derive(Debug, thiserror::Error)]
pub enum UnreadableFile {
    /// The scenario did not come from a folder.
    #[error("{0:?} cannot be found: this scenario is not a file, so nothing lies beside it")]
    NoFolder(String),
    /// It was not kept with the scenario.
    #[error("{0:?} was not kept with the scenario")]
    NotKept(String),
    /// The name leads out of the scenario's folder.
    #[error("{0:?} does not lie beside the scenario; give the name of a file in its folder")]
    Elsewhere(String),
    /// It cannot be read.
    #[error("cannot read {path}: {source}")]
    Unreadable {
        /// The file.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// Not a grid of currents.
    #[error("{path}: {source}")]
    Grid {
        /// The file.
        path: String,
        /// What is wrong.
        source: InvalidGrid,
    },
    /// Not GeoJSON.
    #[error("{path} is not GeoJSON: {source}")]
    NotGeojson {
        /// The file.
        path: String,
        /// Why.
        source: serde_json::Error,
    },
    /// GeoJSON without exactly one line.
    #[error("{path} has {lines} LineStrings, and a path is exactly one")]
    NotOneLine {
        /// The file.
        path: String,
        /// How many there are.
        lines: usize,
    },
    /// A position without longitude or latitude.
    #[error("{path}: position {index} of the line has no longitude and latitude")]
    NoPosition {
        /// The file.
        path: String,
        /// Which, from 0 on.
        index: usize,
    },
}

impl Files {
    /// Those in `folder`.
    #[must_use]
    pub fn beside(folder: &Path) -> Self {
        Self(Place::Folder(folder.to_owned()))
    }

    /// These `texts`, by name, of a scenario that is no longer where it came from.
    #[must_use]
    pub fn kept(texts: BTreeMap<String, String>) -> Self {
        Self(Place::Memory(Arc::new(texts)))
    }

    /// The text of the file called `name`, for [`Self::kept`].
    pub(super) fn text(&self, name: &str) -> Result<String, UnreadableFile> {
        let (bytes, path) = self.bytes(name, GRID_BYTES_MAX)?;
        String::from_utf8(bytes.into_owned()).map_err(|error| UnreadableFile::Unreadable {
            path,
            source: io::Error::other(error),
        })
    }

    /// The grid of currents in the file called `name`.
    pub(super) fn grid(&self, name: &str) -> Result<Arc<CurrentGrid>, UnreadableFile> {
        let (bytes, path) = self.bytes(name, GRID_BYTES_MAX)?;
        let grid = CurrentGrid::read(&bytes[..]);
        grid.map(Arc::new)
            .map_err(|source| UnreadableFile::Grid { path, source })
    }

    /// The places on the only LineString of the GeoJSON file called `name`.
    pub(super) fn line(&self, name: &str) -> Result<Vec<Origin>, UnreadableFile> {
        let (bytes, path) = self.bytes(name, GEOJSON_BYTES_MAX)?;
        let geojson = GeoJson::from_reader(&bytes[..]).map_err(|source| UnreadableFile::NotGeojson {
            path: path.clone(),
            source,
        })?;
        let mut lines = vec![];
        find_lines(&geojson, &mut lines);
        let [line] = lines[..] else {
            return Err(UnreadableFile::NotOneLine {
                path,
                lines: lines.len(),
            });
        };
        let place = |(index, position): (usize, &Position)| match position.as_slice() {
            [longitude, latitude, ..] => Ok(Origin {
                latitude: latitude.to_radians(),
                longitude: longitude.to_radians(),
            }),
            _ => Err(UnreadableFile::NoPosition {
                path: path.clone(),
                index,
            }),
        };
        line.iter().enumerate().map(place).collect()
    }

    /// What is in the file called `name`, and its path. Links that lead out of the folder are not followed.
    fn bytes(&self, name: &str, bytes_max: u64) -> Result<(Cow<'_, [u8]>, String), UnreadableFile> {
        let folder = match &self.0 {
            Place::Nowhere => return Err(UnreadableFile::NoFolder(name.to_owned())),
            Place::Memory(texts) => {
                let text = texts.get(name);
                let text = text.ok_or_else(|| UnreadableFile::NotKept(name.to_owned()))?;
                return Ok((Cow::Borrowed(text.as_bytes()), name.to_owned()));
            }
            Place::Folder(folder) => folder,
        };
        let path = folder.join(name);
        let shown = path.display().to_string();
        let unreadable = |source| UnreadableFile::Unreadable {
            path: shown.clone(),
            source,
        };
        let inside = Path::new(name)
            .components()
            .all(|component| matches!(component, Component::Normal(_)));
        if name.is_empty() || !inside {
            return Err(UnreadableFile::Elsewhere(name.to_owned()));
        }
        // An empty folder is where the program runs.
        let folder = if folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            folder
        };
        let (real, home) = (path.canonicalize(), folder.canonicalize());
        let real = real.map_err(unreadable)?;
        if !real.starts_with(home.map_err(unreadable)?) {
            return Err(UnreadableFile::Elsewhere(name.to_owned()));
        }
        let bytes = read(&real, bytes_max).map_err(unreadable)?;
        Ok((Cow::Owned(bytes), shown))
    }
}

/// What is in the file at `path`: a regular one, whose end is not waited for as a pipe's or a device's would be.
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

fn find_lines<'a>(geojson: &'a GeoJson, lines: &mut Vec<&'a [Position]>) {
    let of_geometry = |geometry: &'a Geometry, lines: &mut Vec<&'a [Position]>| {
        if let GeometryValue::LineString { coordinates } = &geometry.value {
            lines.push(coordinates);
        }
    };
    match geojson {
        GeoJson::Geometry(geometry) => of_geometry(geometry, lines),
        GeoJson::Feature(feature) => {
            if let Some(geometry) = &feature.geometry {
                of_geometry(geometry, lines);
            }
        }
        GeoJson::FeatureCollection(collection) => {
            for geometry in collection
                .features
                .iter()
                .filter_map(|feature| feature.geometry.as_ref())
            {
                of_geometry(geometry, lines);
            }
        }
    }
}
