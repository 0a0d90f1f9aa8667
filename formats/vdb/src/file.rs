//! An open file and its list of grids.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::error::{Error, ErrorKind, Fault, Parsed, Result};
use crate::grid::{GridInfo, TreePlace};
use crate::header::{self, Archive};
use crate::leaf_values::{Halves, LeafValues};
use crate::leaves::{self, Job};
use crate::metadata::Metadata;
use crate::parallel::Parallel;
use crate::reader::Reader;
use crate::source::Source;
use crate::topology::Topology;

/// An OpenVDB file, opened: header, metadata and list of grids are read, voxels are not.
///
/// It may be used by several threads at once.
pub struct File {
    path: PathBuf,
    source: Source,
    archive: Archive,
    grids: Vec<GridInfo>,
    damage: Option<Error>,
}

impl File {
    /// Opens a file and reads what describes its grids: a few kilobytes, whatever its size. (Files
    /// written as streams have no list of grids: their inner nodes are read and their leaves passed
    /// over.)
    ///
    /// # Errors
    /// If the file cannot be read, is no OpenVDB file, has a version other than 221 to 225, or is
    /// damaged before its first grid. A grid that cannot be read does not make this fail: see
    /// [`GridInfo::refusal`] and [`damage`](Self::damage).
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let source = Source::open(path).map_err(|fault| fault.at(path, None))?;
        Self::from_source(path.to_owned(), source)
    }

    /// Reads a file already in memory; `name` stands for its path in error messages.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn from_bytes(name: impl Into<PathBuf>, bytes: Vec<u8>) -> Result<Self> {
        Self::from_source(name.into(), Source::from_bytes(bytes))
    }

    fn from_source(path: PathBuf, source: Source) -> Result<Self> {
        let listing = header::read(&source, &path).map_err(|fault| fault.at(&path, None))?;
        let header::Listing {
            archive,
            grids,
            damage,
        } = listing;
        Ok(Self {
            path,
            source,
            archive,
            grids,
            damage,
        })
    }

    /// The path given to [`open`](Self::open).
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file's length in bytes.
    pub fn size(&self) -> u64 {
        self.source.len()
    }

    /// Bytes read from the file so far, read-ahead included.
    pub fn bytes_read(&self) -> u64 {
        self.source.bytes_read()
    }

    /// The version of the file format, 221 to 225.
    pub fn version(&self) -> u32 {
        self.archive.version
    }

    /// Major and minor version of the library that wrote the file.
    pub fn library(&self) -> [u32; 2] {
        self.archive.library
    }

    /// The file's own metadata.
    pub fn metadata(&self) -> &Metadata {
        &self.archive.metadata
    }

    /// The grids, in the order of the file, those that cannot be read included.
    pub fn grids(&self) -> &[GridInfo] {
        &self.grids
    }

    /// Why the list of grids may lack some at its end: the place where the next one should be
    /// described could not be read.
    pub fn damage(&self) -> Option<&Error> {
        self.damage.as_ref()
    }

    /// The grid of this unique name, or else the first of this name.
    ///
    /// # Errors
    /// [`ErrorKind::Missing`], listing the grids there are.
    pub fn grid(&self, name: &str) -> Result<&GridInfo> {
        let unique = self.grids.iter().find(|grid| grid.unique_name == name);
        let found = unique.or_else(|| self.grids.iter().find(|grid| grid.name == name));
        found.ok_or_else(|| {
            let list: Vec<_> = self.grids.iter().map(GridInfo::summary).collect();
            let mut reason = if list.is_empty() {
                format!("missing grid '{name}'; the file has no grids")
            } else {
                format!("missing grid '{name}'; the file has: {}", list.join(", "))
            };
            if let Some(damage) = &self.damage {
                reason += &format!("; more may follow, but {}", damage.reason);
            }
            Fault::new(ErrorKind::Missing, None, reason).at(&self.path, None)
        })
    }

    /// Reads the shape of a grid's tree: background, tiles, origins and masks of the leaves.
    ///
    /// # Errors
    /// The grid's [`refusal`](GridInfo::refusal), or what is wrong with the tree. On success the file
    /// is long enough to hold all the leaves' buffers, so a caller may make room for them.
    pub fn read_topology(&self, grid: &GridInfo) -> Result<Topology> {
        self.named(grid, |place| {
            let mut reader = Reader::new(&self.source, place.start, place.limit, 1 << 18);
            let topology = Topology::read(&mut reader, &place.encoding, true)?;
            leaves::check_room(&topology, &place.encoding, place.limit)?;
            Ok(topology)
        })
    }

    /// Decodes all leaves of a grid, calling `each` once per leaf, from the tasks given to `parallel`
    /// and in any order: with the leaf's index in [`Topology::leaves`] and its values.
    ///
    /// # Errors
    /// What is wrong with the first bad leaf; `each` may have been called for others.
    pub fn read_leaves(
        &self,
        grid: &GridInfo,
        topology: &Topology,
        halves: Halves,
        parallel: &dyn Parallel,
        each: impl Fn(usize, LeafValues<'_>) + Sync,
    ) -> Result<()> {
        let mut places = vec![(); topology.leaves.len()];
        self.read_leaves_into(
            grid,
            topology,
            halves,
            parallel,
            &mut places,
            |index, values, ()| {
                each(index, values);
            },
        )
    }

    /// Like [`read_leaves`](Self::read_leaves), giving each leaf the exclusive use of its element of
    /// `places`: a brick pool is filled in place, without locks.
    ///
    /// # Errors
    /// As [`read_leaves`](Self::read_leaves).
    ///
    /// # Panics
    /// If `places` does not have one element per leaf, or the topology is another grid's.
    pub fn read_leaves_into<T: Send>(
        &self,
        grid: &GridInfo,
        topology: &Topology,
        halves: Halves,
        parallel: &dyn Parallel,
        places: &mut [T],
        each: impl Fn(usize, LeafValues<'_>, &mut T) + Sync,
    ) -> Result<()> {
        assert_eq!(places.len(), topology.leaves.len(), "one place per leaf");
        self.named(grid, |place| {
            assert_eq!(place.start, topology.start, "the topology of this grid");
            let job = Job {
                source: &self.source,
                encoding: &place.encoding,
                topology,
                limit: place.limit,
                halves,
            };
            job.run(parallel, places, &each)
        })
    }

    fn named<T>(&self, grid: &GridInfo, work: impl FnOnce(&TreePlace) -> Parsed<T>) -> Result<T> {
        if let Some(refusal) = &grid.refusal {
            return Err(refusal.clone());
        }
        let Some(place) = &grid.tree else {
            let fault = Fault::unsupported(grid.range[0], "the grid has no tree");
            return Err(fault.at(&self.path, Some(&grid.unique_name)));
        };
        work(place).map_err(|fault| fault.at(&self.path, Some(&grid.unique_name)))
    }
}

impl fmt::Debug for File {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("File")
            .field("path", &self.path)
            .field("grids", &self.grids)
            .finish()
    }
}
