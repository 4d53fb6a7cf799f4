mod accuracy;
mod degenerate;
mod spoilt;
