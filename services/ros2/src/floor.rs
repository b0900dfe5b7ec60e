//! The warehouse as a grid for planners, as shapes for rviz, and what the services think of it.

use lager_floor::Heading;
use lager_journal::drawn::{self, MAP, NAVIGATOR, ROBOT};
use lager_journal::shapes::{self, Entity, SceneUpdate};
use lager_topics::{BlockedWays, Thought, WarehouseMap};

use crate::messages::{
    ColorRGBA, Log, MapMetaData, Marker, MarkerArray, OccupancyGrid, Pose, Vector3,
};
use crate::told::{Calendar, Frames};

/// The robot needs so much room to each side of a tape, in m: its tracks are 28 cm apart.
const ROOM: f64 = 0.15;
/// Cells along the side of a square: as many as fit.
const FINENESS: [u32; 3] = [16, 8, 4];
/// The most cells of a grid. A message of 250 kB is with a late reader in half a second.
const MOST_CELLS: u64 = 250_000;
/// How far a thing on a way is taken to reach along it, in m.
const THING: f64 = 0.1;

const FREE: i8 = 0;
const OCCUPIED: i8 = 100;
const UNKNOWN: i8 = -1;

/// Where a robot may drive: free along the tapes, occupied where shelves stand between them and where
/// something blocks a way, not known outside. `None` while the side of a square is not known.
pub fn grid(
    map: &WarehouseMap,
    blocks: Option<&BlockedWays>,
    (calendar, at_ns): (Calendar, u64),
    frames: &Frames,
) -> Option<OccupancyGrid> {
    let side = drawn::side_m(map);
    let (columns, rows) = (u32::from(map.width), u32::from(map.height));
    if side == 0.0 || columns == 0 || rows == 0 {
        return None;
    }
    let measured = FINENESS.map(|fine| Measured::new(side, fine, [columns, rows]));
    let fits = |grid: &&Measured| u64::from(grid.width) * u64::from(grid.height) <= MOST_CELLS;
    let grid = measured.iter().find(fits).unwrap_or(&measured[2]);
    let things: Vec<[[f64; 2]; 2]> = blocks
        .map_or(&[][..], BlockedWays::ways)
        .iter()
        .filter_map(|way| Some((way.x, way.y, way.heading.get()?)))
        .map(|(x, y, heading)| thing((x, y), heading, side))
        .collect();
    let (right, top) = (f64::from(columns) * side, f64::from(rows) * side);
    let cell = |index: u32| {
        let [x, y] = [index % grid.width, index / grid.width]
            .map(|cell| grid.origin + (f64::from(cell) + 0.5) * grid.cell);
        let is_in = |[[x0, x1], [y0, y1]]: &[[f64; 2]; 2]| {
            (*x0..=*x1).contains(&x) && (*y0..=*y1).contains(&y)
        };
        let off = |at: f64, most: f64| {
            let nearest = (at / side).round().clamp(0.0, (most / side).round()) * side;
            (at - nearest).abs()
        };
        let room = grid.room;
        let beside = |at: f64, most: f64| (-room..=most + room).contains(&at);
        let is_way =
            (off(x, right) <= room && beside(y, top)) || (off(y, top) <= room && beside(x, right));
        match () {
            () if things.iter().any(is_in) => OCCUPIED,
            () if is_way => FREE,
            () if (0.0..=right).contains(&x) && (0.0..=top).contains(&y) => OCCUPIED,
            () => UNKNOWN,
        }
    };
    Some(OccupancyGrid {
        header: calendar.header(at_ns, frames.map()),
        info: MapMetaData {
            map_load_time: calendar.time(at_ns),
            resolution: grid.cell as f32,
            width: grid.width,
            height: grid.height,
            origin: Pose {
                position: Vector3 {
                    x: grid.origin,
                    y: grid.origin,
                    z: 0.0,
                },
                ..Pose::default()
            },
        },
        data: (0..grid.width * grid.height).map(cell).collect(),
    })
}

/// A grid's measures, in m and cells.
#[derive(Clone, Copy, Debug)]
struct Measured {
    cell: f64,
    /// Both coordinates of its outer corner.
    origin: f64,
    width: u32,
    height: u32,
    /// How far a way reaches to each side of its tape: a cell at least.
    room: f64,
}

impl Measured {
    fn new(side: f64, fine: u32, [columns, rows]: [u32; 2]) -> Self {
        let cell = side / f64::from(fine);
        let room = ROOM.max(cell / 2.0);
        // One cell beyond the ways shows that nothing is known there.
        let margin = (room / cell).ceil() as u32 + 1;
        Self {
            cell,
            origin: -f64::from(margin) * cell,
            width: columns * fine + 2 * margin,
            height: rows * fine + 2 * margin,
            room,
        }
    }
}

/// The ground that a thing in the middle of a way takes, as ranges of x and y.
fn thing((x, y): (u8, u8), heading: Heading, side: f64) -> [[f64; 2]; 2] {
    let (right, up) = heading.step();
    let middle = [(x, right), (y, up)];
    let middle = middle.map(|(node, step)| (f64::from(node) + f64::from(step) / 2.0) * side);
    // Nothing passes beside it.
    let half = match heading {
        Heading::Left | Heading::Right => [THING, ROOM],
        Heading::Up | Heading::Down => [ROOM, THING],
    };
    [0, 1].map(|axis| [middle[axis] - half[axis], middle[axis] + half[axis]])
}

/// Shapes for rviz. The first marker takes away what the topic showed before, so each message is a
/// whole picture.
pub fn markers(
    scene: &SceneUpdate,
    (calendar, at_ns): (Calendar, u64),
    frames: &Frames,
) -> MarkerArray {
    let mut markers = vec![Marker {
        header: calendar.header(at_ns, frames.map()),
        action: Marker::DELETE_ALL,
        ..Marker::default()
    }];
    for entity in &scene.entities {
        let header = calendar.header(at_ns, frame(entity, frames));
        let plain = || Marker {
            header: header.clone(),
            ns: entity.id.to_owned(),
            frame_locked: true,
            ..Marker::default()
        };
        markers.extend(entity.lines.iter().map(|lines| Marker {
            kind: Marker::LINE_LIST,
            scale: scale(lines.thickness, 0.0, 0.0),
            color: color(lines.color),
            points: lines.points.iter().map(|point| (*point).into()).collect(),
            ..plain()
        }));
        markers.extend(entity.cubes.iter().map(|cube| Marker {
            kind: Marker::CUBE,
            pose: cube.pose.into(),
            scale: cube.size.into(),
            color: color(cube.color),
            ..plain()
        }));
        markers.extend(entity.arrows.iter().map(|arrow| Marker {
            kind: Marker::ARROW,
            pose: arrow.pose.into(),
            scale: scale(
                arrow.shaft_length + arrow.head_length,
                arrow.shaft_diameter,
                arrow.head_diameter,
            ),
            color: color(arrow.color),
            ..plain()
        }));
        markers.extend(entity.texts.iter().map(|label| Marker {
            kind: Marker::TEXT,
            pose: label.pose.into(),
            scale: scale(0.0, 0.0, label.font_size),
            color: color(label.color),
            text: label.text.clone(),
            ..plain()
        }));
    }
    for (id, marker) in (0..).zip(&mut markers) {
        marker.id = id;
    }
    MarkerArray { markers }
}

fn frame(entity: &Entity, frames: &Frames) -> String {
    match entity.frame_id {
        NAVIGATOR => frames.base(),
        ROBOT => frames.truth(),
        other => {
            debug_assert_eq!(other, MAP);
            frames.map()
        }
    }
}

const fn scale(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

fn color(shapes::Color { r, g, b, a }: shapes::Color) -> ColorRGBA {
    let [r, g, b, a] = [r, g, b, a].map(|part| part as f32);
    ColorRGBA { r, g, b, a }
}

/// A service's thought, as a line of ROS's log.
pub fn log(thought: &Thought, (calendar, at_ns): (Calendar, u64), frames: &Frames) -> Log {
    let said = drawn::log(thought, shapes::Time::of_ns(calendar.unix_ns(at_ns)));
    Log {
        stamp: calendar.time(at_ns),
        // Foxglove counts 2 and 3 where ROS counts 20 and 30.
        level: said.level * 10,
        name: format!("{}.{}", frames.robot(), said.name),
        msg: said.message,
        file: String::new(),
        function: String::new(),
        line: 0,
    }
}

#[cfg(test)]
mod tests {
    use lager_topics::{MapProduct, ThoughtKind};

    use super::*;

    const AT: (Calendar, u64) = (Calendar::new(0), 5);

    fn map(width: u8, height: u8, side_length_cm: u16) -> WarehouseMap {
        let mut map = WarehouseMap {
            width,
            height,
            side_length_cm,
            product_count: 1,
            ..WarehouseMap::default()
        };
        map.products[0] = MapProduct {
            id: 7,
            x: 1,
            y: 0,
            side: Heading::Up.into(),
            ..MapProduct::default()
        };
        map
    }

    fn at(grid: &OccupancyGrid, x: f64, y: f64) -> i8 {
        let MapMetaData {
            resolution, origin, ..
        } = grid.info;
        let cell = |at: f64, from: f64| ((at - from) / f64::from(resolution)).floor() as usize;
        let column = cell(x, origin.position.x);
        let row = cell(y, origin.position.y);
        grid.data[row * grid.info.width as usize + column]
    }

    #[test]
    fn a_grid_is_not_mirrored_and_not_turned() {
        let mut blocks = BlockedWays {
            count: 1,
            ..BlockedWays::default()
        };
        (blocks.ways[0].x, blocks.ways[0].y) = (1, 2);
        blocks.ways[0].heading = Heading::Right.into();
        let frames = Frames::of("r1");
        let grid = grid(&map(4, 2, 60), Some(&blocks), AT, &frames).expect("a grid");
        assert_eq!(grid.data.len() as u32, grid.info.width * grid.info.height);
        assert!(grid.info.width > grid.info.height);
        for ((x, y), expected) in [
            ((0.0, 0.0), FREE),      // a corner
            ((0.3, 0.3), OCCUPIED),  // a shelf
            ((2.4, 0.7), FREE),      // the rightmost way
            ((0.9, 1.2), OCCUPIED),  // what blocks the way
            ((0.9, 0.6), FREE),      // the way below it
            ((1.5, 1.2), FREE),      // the next way
            ((-0.17, 0.3), UNKNOWN), // outside
        ] {
            assert_eq!(at(&grid, x, y), expected, "({x}, {y})");
        }
        assert_eq!(
            grid.info.origin.orientation,
            crate::messages::Quaternion::default()
        );
        assert!(grid.data.iter().all(|cell| (-1..=100).contains(cell)));
    }

    #[test]
    fn a_grid_is_never_too_large_and_its_ways_never_vanish() {
        for (width, height, side) in [(99, 99, 500), (1, 99, 20), (99, 1, 20)] {
            let grid = grid(&map(width, height, side), None, AT, &Frames::of("r1"));
            let grid = grid.expect("a grid");
            assert!(grid.data.len() as u64 <= MOST_CELLS, "{}", grid.data.len());
            let side = f64::from(side) / 100.0;
            assert_eq!(at(&grid, f64::from(width) * side - 0.01, side / 2.0), FREE);
        }
        assert!(grid(&map(4, 3, 0), None, AT, &Frames::of("r1")).is_none());
    }

    #[test]
    fn a_picture_replaces_the_one_before_and_every_turn_is_one() {
        let map = map(4, 3, 40);
        let scene = drawn::map(&map, shapes::Time::of_ns(5));
        let MarkerArray { markers } = markers(&scene, AT, &Frames::of("r1"));
        assert_eq!(markers[0].action, Marker::DELETE_ALL);
        let kinds: Vec<i32> = markers[1..].iter().map(|marker| marker.kind).collect();
        assert_eq!(
            kinds,
            [
                Marker::LINE_LIST,
                Marker::CUBE,
                Marker::CUBE,
                Marker::TEXT,
                Marker::TEXT
            ]
        );
        assert_eq!(markers[1].points.len(), 2 * (4 + 1 + 3 + 1));
        assert!(markers.iter().any(|marker| marker.text == "7"));
        for (id, marker) in markers.iter().enumerate() {
            assert_eq!(marker.id as usize, id);
            let turn = marker.pose.orientation;
            let norm = turn.x * turn.x + turn.y * turn.y + turn.z * turn.z + turn.w * turn.w;
            assert!((norm - 1.0).abs() < 1e-9, "{marker:?}");
            assert_eq!(marker.header.frame_id, "r1/map");
        }
    }

    #[test]
    fn bodies_stand_in_the_robots_frames() {
        let scene = drawn::bodies(shapes::Time::of_ns(5));
        let MarkerArray { markers } = markers(&scene, AT, &Frames::of("r2"));
        let frames: Vec<_> = markers
            .iter()
            .map(|one| one.header.frame_id.as_str())
            .collect();
        assert!(frames.contains(&"r2/base_link") && frames.contains(&"r2/ground_truth"));
    }

    #[test]
    fn a_failure_is_a_warning_of_ros() {
        let level = |kind: ThoughtKind| log(&kind.into(), AT, &Frames::of("r1")).level;
        assert_eq!(level(ThoughtKind::MapTaken), 20);
        assert_eq!(level(ThoughtKind::BatteryLow), 30);
    }
}
