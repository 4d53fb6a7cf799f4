use pose::{feature::*, image::GrayImage};
use std::path::*;
fn main() {
    let dir = PathBuf::from(std::env::args().nth(1).unwrap());
    let mut config = LineConfig::default();
    let mut other = None;
    for a in std::env::args().skip(2) {
        let (k, v) = a.split_once('=').unwrap();
        if k == "segments" {
            other = Some(PathBuf::from(v));
            continue;
        }
        let f: f64 = v.parse().unwrap();
        match k {
            "ag" => config.anchor_gradient = f,
            "eg" => config.edge_gradient = f,
            "si" => config.scan_interval_px = f as usize,
            "rms" => config.max_rms_px = f,
            "dev" => config.max_deviation_px = f,
            "out" => config.max_outliers_px = f as usize,
            "nfa" => config.max_false_alarms = f,
            "gap" => config.max_gap_px = f,
            "mdeg" => config.max_turn_rad = f.to_radians(),
            "seed" => config.seed_px = f as usize,
            "th" => config.max_threads = f as usize,
            _ => panic!("{k}"),
        }
    }
    {
        // noise
        for sigma in [5.0f32, 20.0, 50.0] {
            let mut st = 1u64;
            let mut n = 0;
            for _ in 0..5 {
                let px = (0..640 * 480)
                    .map(|_| {
                        let mut a = 0.0f32;
                        for _ in 0..12 {
                            st = st
                                .wrapping_mul(6364136223846793005)
                                .wrapping_add(1442695040888963407);
                            a += (st >> 40) as f32 / (1u64 << 24) as f32;
                        }
                        (128.0 + sigma * (a - 6.0)).clamp(0.0, 255.0) as u8
                    })
                    .collect();
                n += LineDetector::new(config)
                    .unwrap()
                    .detect(&GrayImage::new(640, 480, px).unwrap())
                    .len();
            }
            print!("noise {sigma}: {} ", n as f32 / 5.0);
        }
        println!();
    }
    let mut names: Vec<_> = std::fs::read_dir(&dir)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "jpg"))
        .collect();
    names.sort();
    let mut det = LineDetector::new(config).unwrap();
    let (mut hit, mut hit2, mut tot, mut n, mut len) = (0.0, 0.0, 0.0, 0, 0.0);
    let mut times: Vec<f64> = vec![];
    let mut steps: Vec<(LineStep, Vec<f64>)> = vec![];
    for name in &names {
        let bytes = std::fs::read(name).unwrap();
        let opt = zune_jpeg::zune_core::options::DecoderOptions::default()
            .jpeg_set_out_colorspace(zune_jpeg::zune_core::colorspace::ColorSpace::Luma);
        let mut d = zune_jpeg::JpegDecoder::new_with_options(std::io::Cursor::new(&bytes), opt);
        let px = d.decode().unwrap();
        let (w, h) = d.dimensions().unwrap();
        let img = GrayImage::new(w, h, px).unwrap();
        let mut segs = vec![];
        if let Some(o) = &other {
            let t = std::fs::read_to_string(
                o.join(name.with_extension("segments.txt").file_name().unwrap()),
            )
            .unwrap();
            for l in t.lines() {
                let v: Vec<f32> = l.split_whitespace().map(|x| x.parse().unwrap()).collect();
                segs.push([[v[0], v[1]], [v[2], v[3]]]);
            }
        } else {
            let mut best = f64::MAX;
            let mut bests: Vec<f64> = vec![f64::MAX; 16];
            for r in 0..10 {
                let t = std::time::Instant::now();
                let mut at = t;
                let mut now: Vec<(LineStep, f64)> = vec![];
                let s = det.detect_in_steps(&img, |step| {
                    let n = std::time::Instant::now();
                    now.push((step, (n - at).as_secs_f64()));
                    at = n;
                });
                if r > 0 {
                    best = best.min(t.elapsed().as_secs_f64() * 1e3);
                    for (i, &(name, t)) in now.iter().enumerate() {
                        if steps.len() <= i {
                            steps.push((name, vec![]));
                        }
                        bests[i] = bests[i].min(t * 1e3);
                    }
                }
                if r == 9 {
                    times.push(best);
                    for i in 0..steps.len() {
                        steps[i].1.push(bests[i]);
                    }
                }
                segs = s.iter().map(|s| [s.start_px, s.end_px]).collect();
            }
            std::fs::create_dir_all("/tmp/h/linwork/ours").unwrap();
            let t: String = segs
                .iter()
                .map(|s| format!("{:.3} {:.3} {:.3} {:.3}\n", s[0][0], s[0][1], s[1][0], s[1][1]))
                .collect();
            std::fs::write(
                Path::new("/tmp/h/linwork/ours")
                    .join(name.with_extension("segments.txt").file_name().unwrap()),
                t,
            )
            .unwrap();
        }
        n += segs.len();
        len += segs.iter().map(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1])).sum::<f32>();
        for l in std::fs::read_to_string(name.with_extension("lines.txt"))
            .unwrap()
            .lines()
            .filter(|l| !l.starts_with('#'))
        {
            let v: Vec<f32> = l.split_whitespace().map(|x| x.parse().unwrap()).collect();
            let (c0, l) = cover([v[0], v[1]], [v[2], v[3]], &segs, 0.0);
            let (c2, _) = cover([v[0], v[1]], [v[2], v[3]], &segs, 2.0);
            hit += c0 * l;
            hit2 += c2 * l;
            tot += l;
        }
    }
    times.sort_by(f64::total_cmp);
    println!(
        "recall {:.4} slack {:.4} segments {:.1} mean len {:.1} ms median {:.2}",
        hit / tot,
        hit2 / tot,
        n as f32 / names.len() as f32,
        len / n as f32,
        times.get(times.len() / 2).unwrap_or(&0.0)
    );
    for (n, t) in &mut steps {
        t.sort_by(f64::total_cmp);
        print!("{n:?} {:.2} ", t[t.len() / 2]);
    }
    println!();
}
fn cover(a: [f32; 2], b: [f32; 2], segs: &[[[f32; 2]; 2]], slack: f32) -> (f32, f32) {
    let l = (a[0] - b[0]).hypot(a[1] - b[1]);
    let u = [(b[0] - a[0]) / l, (b[1] - a[1]) / l];
    let n = l.ceil().max(1.0) as usize;
    let mut hit = vec![false; n];
    for [p, q] in segs {
        let m = (p[0] - q[0]).hypot(p[1] - q[1]);
        if m == 0.0 {
            continue;
        }
        let d = [(q[0] - p[0]) / m, (q[1] - p[1]) / m];
        if (d[0] * u[0] + d[1] * u[1]).abs() < 5f32.to_radians().cos() {
            continue;
        }
        for (i, h) in hit.iter_mut().enumerate() {
            let t = (i as f32 + 0.5) * l / n as f32;
            let r = [a[0] + t * u[0] - p[0], a[1] + t * u[1] - p[1]];
            let s = r[0] * d[0] + r[1] * d[1];
            if s >= -slack && s <= m + slack && (r[0] * d[1] - r[1] * d[0]).abs() <= 2.0 {
                *h = true;
            }
        }
    }
    (hit.iter().filter(|h| **h).count() as f32 / n as f32, l)
}
