use pose::{image::GrayImage, feature::points::*};
use std::time::Instant;
fn main(){
    let b=std::fs::read(std::env::args().nth(1).unwrap()).unwrap();
    let image=GrayImage::new(640,480,b).unwrap();
    for threads in [1,2]{
        let mut e=PointExtractor::new(PointConfig{threads,..Default::default()}).unwrap();
        let mut t=vec![];
        let mut n=0;
        for _ in 0..200 { let a=Instant::now(); n=e.extract(&image).len(); t.push(a.elapsed().as_secs_f64()*1e3); }
        t.sort_by(f64::total_cmp);
        println!("{threads} threads {n} corners: min {:.3} median {:.3}",t[0],t[100]);
    }
}
