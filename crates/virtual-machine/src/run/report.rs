use std::collections::BTreeMap;

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::AxisValues;
use facemill_nc_program::ReadProgram;
use facemill_nc_program::read::ReadBlock;

use crate::finding::episodes::{Contact, Episode, Episodes, Key};
use crate::finding::{
    AxisReading, BetweenPositions, ClearancePlace, Finding, FindingKind, GougePlace, Pose, SectionGouge, TextFault,
    Verification, WindUp, reader_notes,
};
use crate::motion::moves::ResolvedMoves;
use crate::motion::setup::{GougeSection, own_head};
use crate::program_time::timing::duration;
use crate::run::between::cutter_between;
use crate::run::chunk_result::{ChunkResult, Clearance, Gouge, Gouges, nearest};
use crate::run::edges::estimated_steps;
use crate::run::scene::RunScene;
use crate::run::surface_normals;

/// Data for the figures of a run.
pub(crate) struct Report<'a> {
    pub(crate) program: &'a ReadProgram,
    pub(crate) scene: &'a RunScene<'a>,
    resolved: &'a ResolvedMoves,
    /// When each move starts, and the last one ends, s since the start of the program.
    starts: Vec<f64>,
}

/// Returns the note on a body that comes near the cut stock.
fn near(key: &Key) -> Option<&'static str> {
    let of_body = match (key.body, key.kind) {
        (Some(_), _) => "nearer than its clearance",
        (None, FindingKind::NearMiss) => "back along its axis out of what it has cut",
        (None, _) => "nearer to a line than half a cell, or between the lines in the stock",
    };
    (!key.is_contact).then_some(of_body)
}

/// Name of the stock that the program cuts; its index is behind those of the obstacles.
const STOCK: &str = "stock";

impl<'a> Report<'a> {
    pub(crate) fn new(program: &'a ReadProgram, scene: &'a RunScene<'a>, resolved: &'a ResolvedMoves) -> Self {
        let mut now = 0.0;
        let mut starts = vec![now];
        for m in &resolved.moves {
            // A move without a feed has no time: it is a fault of its own.
            now += duration(scene.setup.machine, m, scene.tool_length).unwrap_or(0.0);
            starts.push(now);
        }
        Self { program, scene, resolved, starts }
    }

    /// One report of all chunks, which are in the order of the program.
    pub(crate) fn assemble(&self, results: Vec<ChunkResult>) -> Verification {
        let mut episodes = Episodes::default();
        let mut gouges = Gouges::default();
        let clearance = nearest(results.iter().map(|r| r.clearance));
        let estimate = self.scene.settings.estimate;
        let mut v = Verification {
            findings: Vec::new(),
            largest_gouge: None,
            sections: Vec::new(),
            smallest_clearance: None,
            between: estimate.is_none().then(|| self.between(&results)),
            estimate: estimate.map(|estimate| estimated_steps(self.scene, estimate)),
            wind_up: self.wind_up(),
            n_positions: 0,
            n_blocks: self.program.motions().count(),
            cutting_time_s: 0.0,
            rapid_time_s: 0.0,
            cutting_length_mm: 0.0,
        };
        for r in results {
            r.episodes.all.into_iter().for_each(|e| episodes.add(e));
            gouges.add_all(&r.gouges);
            v.n_positions += r.n_positions;
            v.cutting_time_s += r.cutting_time;
            v.rapid_time_s += r.rapid_time;
            v.cutting_length_mm += r.cutting_length;
        }
        v.largest_gouge = gouges.deepest_of_all().map(|g| self.gouge_place(&g));
        v.sections = self.sections(&gouges);
        v.smallest_clearance = clearance.map(|c| self.clearance_place(&c));
        v.findings = episodes.all.iter().map(|e| self.finding(e)).chain(self.text_findings()).collect();
        v.findings.extend(reader_notes::findings(self.program));
        v.findings.extend(reader_notes::no_end(self.program).filter(|_| self.scene.settings.is_whole));
        self.place(&mut v.findings);
        v.findings.sort_by_key(|f| (f.first_line, f.kind));
        v
    }

    fn wind_up(&self) -> Vec<WindUp> {
        let axes = self.scene.setup.machine.axes().iter().enumerate().filter(|(_, a)| a.has_no_stops());
        axes.map(|(k, axis)| {
            let values = self.resolved.moves.iter().flat_map(|m| [m.start[k], m.end[k]]);
            let [least, greatest] = values.fold([axis.home; 2], |[low, high], v| [low.min(v), high.max(v)]);
            WindUp {
                axis: axis.letter.to_string(),
                least_deg: least.to_degrees(),
                greatest_deg: greatest.to_degrees(),
                turns: (greatest - least) / std::f64::consts::TAU,
            }
        })
        .collect()
    }

    fn between(&self, results: &[ChunkResult]) -> BetweenPositions {
        let (cutter, settings) = (self.scene.setup.tool.cutter(), self.scene.settings);
        let mut blocks: Vec<usize> =
            results.iter().flat_map(|r| &r.open).map(|&k| self.resolved.moves[k].block).collect();
        blocks.dedup();
        BetweenPositions {
            cutter_mm: cutter_between(cutter, settings),
            bodies_mm: settings.between,
            open_blocks: blocks.len(),
            first_open_line: blocks.first().map(|&k| self.program.blocks[k].line),
        }
    }

    fn sections(&self, gouges: &Gouges) -> Vec<SectionGouge> {
        let of_section = |(k, s): (usize, &GougeSection)| SectionGouge {
            name: s.name.clone(),
            first_line: s.first_line,
            gouge_limit_mm: s.gouge_limit,
            largest_gouge: gouges.deepest(k + 1).map(|g| self.gouge_place(&g)),
        };
        self.scene.settings.sections.iter().enumerate().map(of_section).collect()
    }

    fn gouge_place(&self, g: &Gouge) -> GougePlace {
        GougePlace {
            depth_mm: g.depth.depth,
            obstacle: self.obstacle(g.obstacle),
            line: self.block(g.move_index).line,
            place_work_mm: g.depth.place.coords.into(),
        }
    }

    fn clearance_place(&self, c: &Clearance) -> ClearancePlace {
        ClearancePlace {
            distance_mm: c.distance,
            body: self.scene.bodies[c.body].name.clone(),
            obstacle: self.obstacle(c.obstacle),
            line: self.block(c.move_index).line,
            place_work_mm: c.place.coords.into(),
        }
    }

    pub(crate) fn finding(&self, e: &Episode) -> Finding {
        let Contact { key, measure, place, ref axes, cl, at } = e.worst;
        let worst = self.block(e.worst_move);
        let body = match key.body {
            Some(k) => Some(self.scene.bodies[k].name.clone()),
            // A contact with an obstacle by no other body is the cutter's.
            None => key.obstacle.map(|_| "cutter".to_owned()),
        };
        Finding {
            kind: key.kind,
            first_line: self.block(e.first_move).line,
            last_line: self.block(e.last_move).line,
            worst_line: worst.line,
            episodes: 1,
            block_number: worst.number,
            block_text: worst.text.to_string(),
            body,
            obstacle: key.obstacle.map(|k| self.obstacle(k)),
            axis: key.axis.map(|k| self.scene.setup.machine.axes()[k].letter.to_string()),
            measure,
            place_work_mm: place.map(|p| p.coords.into()),
            pose: Some(self.pose(axes, &cl)),
            time_s: Some(self.time(e.worst_move, at)),
            note: self.note(&key),
        }
    }

    /// Returns the explanation of an episode besides its numbers; on several heads with the name of
    /// the head.
    fn note(&self, key: &Key) -> String {
        let head = own_head(self.scene.setup).map(|head| format!("head {}", head.name));
        let own = surface_normals::note(key).or_else(|| near(key)).map(str::to_owned);
        own.into_iter().chain(head).collect::<Vec<_>>().join(", ")
    }

    /// Adds to findings without a pose the position of the machine before their block, and the
    /// time.
    pub(crate) fn place(&self, findings: &mut [Finding]) {
        for finding in findings.iter_mut().filter(|f| f.pose.is_none()) {
            let index = self.program.blocks.partition_point(|b| b.line < finding.worst_line);
            // Behind the end there are lines and no blocks.
            if self.program.blocks.get(index).is_none_or(|b| b.line != finding.worst_line) {
                continue;
            }
            finding.pose = self.resolved.axes_before[index].map(|axes| self.pose(&axes, &self.scene.cl_at(&axes)));
            let next = self.resolved.moves.partition_point(|m| m.block < index);
            finding.time_s = Some(self.starts[next]);
        }
    }

    /// Faults of the text, those alike without a motion between them as one.
    fn text_findings(&self) -> Vec<Finding> {
        let mut runs: Vec<TextFault> = Vec::new();
        let mut latest = BTreeMap::new();
        for fault in &self.resolved.faults {
            let key = (fault.kind, fault.axis, &fault.note);
            let open = latest.get(&key).map(|&k: &usize| &mut runs[k]);
            if let Some(run) = open.filter(|run| !self.moves_between(run.last, fault.block)) {
                run.last = fault.last.max(run.last);
                if fault.measure.is_some_and(|m| run.measure.is_none_or(|worst| m.is_worse_than(&worst))) {
                    (run.worst, run.measure) = (fault.worst, fault.measure);
                }
            } else {
                latest.insert(key, runs.len());
                runs.push(fault.clone());
            }
        }
        runs.iter().map(|run| self.text_finding(run)).collect()
    }

    /// Whether a block between these two moves an axis to a known place.
    fn moves_between(&self, first: usize, last: usize) -> bool {
        let next = self.resolved.moves.partition_point(|m| m.block <= first);
        self.resolved.moves.get(next).is_some_and(|m| m.block < last)
    }

    fn text_finding(&self, fault: &TextFault) -> Finding {
        let block = &self.program.blocks[fault.worst];
        Finding {
            kind: fault.kind,
            first_line: self.program.blocks[fault.block].line,
            last_line: self.program.blocks[fault.last].line,
            worst_line: block.line,
            episodes: 1,
            block_number: block.number,
            block_text: block.text.to_string(),
            body: None,
            obstacle: None,
            axis: fault.axis.map(|a| a.to_string()),
            measure: fault.measure,
            place_work_mm: None,
            pose: None,
            time_s: None,
            note: fault.note.clone(),
        }
    }

    /// Time at a fraction of a move's, s.
    fn time(&self, move_index: usize, at: f64) -> f64 {
        let [start, end] = [self.starts[move_index], self.starts[move_index + 1]];
        start + at * (end - start)
    }

    fn pose(&self, axes: &AxisValues, cl: &ClPoint) -> Pose {
        Pose {
            tip_work_mm: cl.tip.coords.into(),
            axis_work: cl.axis.into_inner().into(),
            axis_values: self.readings(axes),
        }
    }

    fn readings(&self, q: &AxisValues) -> Vec<AxisReading> {
        let axes = self.scene.setup.machine.axes().iter().enumerate();
        axes.map(|(k, a)| AxisReading { axis: a.letter.to_string(), value: a.in_word_unit(q[k]) }).collect()
    }

    fn obstacle(&self, index: usize) -> String {
        self.scene.obstacles.get(index).map_or_else(|| STOCK.to_owned(), |o| o.name.clone())
    }

    fn block(&self, move_index: usize) -> &ReadBlock {
        &self.program.blocks[self.resolved.moves[move_index].block]
    }
}
