//! Files that a scenario names: read from the folder it lies in, and nowhere else.

use std::{
    fs::File,
    io,
    path::{Component, Path, PathBuf},
    sync::Arc,
};

use geojson::{GeoJson, Geometry, GeometryValue, Position};

use crate::{
    record::Origin,
    water::{CurrentGrid, InvalidGrid},
};

/// Largest GeoJSON file that is read, bytes.
const GEOJSON_BYTES_MAX: u64 = 10_000_000;

/// Where a scenario's other files are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Files {
    folder: Option<PathBuf>,
}

/// Why a file that a scenario names is of no use.
#[derive(Debug, thiserror::Error)]
pub enum UnreadableFile {
    /// The scenario did not come from a folder.
    #[error("{0:?} cannot be found: this scenario is not a file, so nothing lies beside it")]
    NoFolder(String),
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
    /// Larger than any path.
    #[error("{path} has {bytes} bytes, and {GEOJSON_BYTES_MAX} are allowed")]
    TooLarge {
        /// The file.
        path: String,
        /// Its size.
        bytes: u64,
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
        Self {
            folder: Some(folder.to_owned()),
        }
    }

    /// The grid of currents in the file called `name`.
    pub(super) fn grid(&self, name: &str) -> Result<Arc<CurrentGrid>, UnreadableFile> {
        let (file, path) = self.open(name)?;
        let grid = CurrentGrid::read(io::BufReader::new(file));
        grid.map(Arc::new)
            .map_err(|source| UnreadableFile::Grid { path, source })
    }

    /// The places on the only LineString of the GeoJSON file called `name`.
    pub(super) fn line(&self, name: &str) -> Result<Vec<Origin>, UnreadableFile> {
        let (file, path) = self.open(name)?;
        let bytes = file
            .metadata()
            .map_err(|source| UnreadableFile::Unreadable {
                path: path.clone(),
                source,
            })?
            .len();
        if GEOJSON_BYTES_MAX < bytes {
            return Err(UnreadableFile::TooLarge { path, bytes });
        }
        let geojson = geojson::GeoJson::from_reader(io::BufReader::new(file)).map_err(|source| {
            UnreadableFile::NotGeojson {
                path: path.clone(),
                source,
            }
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

    fn open(&self, name: &str) -> Result<(File, String), UnreadableFile> {
        let Some(folder) = &self.folder else {
            return Err(UnreadableFile::NoFolder(name.to_owned()));
        };
        let inside = Path::new(name)
            .components()
            .all(|component| matches!(component, Component::Normal(_)));
        if name.is_empty() || !inside {
            return Err(UnreadableFile::Elsewhere(name.to_owned()));
        }
        let path = folder.join(name);
        let shown = path.display().to_string();
        match File::open(&path) {
            Ok(file) => Ok((file, shown)),
            Err(source) => Err(UnreadableFile::Unreadable { path: shown, source }),
        }
    }
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
