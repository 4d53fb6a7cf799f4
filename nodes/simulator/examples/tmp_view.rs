use simulator::*;
fn main() {
    let s = Scenario::demo();
    let mut gaps=[0usize;360]; let mut lens=0;
    for x in s.clone().without_objects().with_depth_size(8,6).samples().unwrap() { if let Sample::Scan{scan,..}=x { lens+=1; for b in 0..360 { if scan.measured_range_m(b).is_none(){gaps[b]+=1;} if lens==5 && (134..=224).contains(&b) {print!("{:.0}:{:.2} ",scan.azimuth_rad(b).to_degrees(),scan.ranges_m[b]);} } } }
    println!("\nscans {lens}");
    for b in 134..=224 { if gaps[b]>4 { println!("az {} gaps {}", b as i32-179, gaps[b]); } }
    let mut n=0; let mut vis=[0;3]; let (mut reach, mut near, mut far)=(0.0f64,9.0f64,0.0f64);
    for x in s.samples().unwrap() { 
        let t=x.stamp().seconds_since(s.start);
        if let Sample::ObjectPoses(p)=&x { for o in &p.objects { if o.visible_pixels>0 {vis[o.id as usize]+=1;} } }
        if let Sample::Depth{image,labels}=x {
        n+=1; for (i,&l) in labels.object_ids().iter().enumerate() { if l==2 { let d=image.depth_m(i%640,i/640).unwrap() as f64; near=near.min(d); far=far.max(d);
          let y=-((i%640) as f64-314.5)/575.8*d; let y0=2.9-0.0; let _=y0; let py=s.scene.objects[1].path.position_at(t).y; reach=reach.max((y-py).abs()); } }
        let mid=|k:usize| (s.scene.objects[k].path.waypoints[0].time_s+s.scene.objects[k].path.end_s())/2.0;
        for (k,name) in [(0,"robot"),(1,"person")] { if (t-mid(k)).abs()<1.0/60.0 { 
            let mut out=format!("P2\n640 480\n65535\n"); let mut lo=format!("P2\n640 480\n255\n");
            for i in 0..640*480 { let d=image.depth_m(i%640,i/640).unwrap_or(0.0); out+=&format!("{}\n",(d*1000.0) as u32); lo+=&format!("{}\n",labels.object_ids()[i]*100); }
            std::fs::write(format!("/tmp/view_{name}.pgm"),out).unwrap(); std::fs::write(format!("/tmp/view_{name}_l.pgm"),lo).unwrap(); println!("{name} {t}"); } }
    } }
    println!("images {n} vis {vis:?} reach {reach} near {near} far {far}");
    let c=Scenario::small().static_scene_cloud().unwrap();
    let f=|g:fn(&nalgebra::Point3<f32>)->f64| { let v:Vec<f64>=c.points_m.iter().map(g).collect(); (v.iter().cloned().fold(9.0,f64::min),v.iter().cloned().fold(-9.0,f64::max)) };
    println!("cloud {} x {:?} y {:?} z {:?}", c.points_m.len(), f(|p|f64::from(p.x)), f(|p|f64::from(p.y)), f(|p|f64::from(p.z)));
    println!("wall {}", c.points_m.iter().filter(|p| (p.x as f64-4.5).abs()<1e-3).count());
}
