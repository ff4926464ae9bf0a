//! Links the library that the environment names.

fn main() {
    println!("cargo:rerun-if-env-changed=EMBREE_LIBRARY");
    let library = std::env::var("EMBREE_LIBRARY").expect("EMBREE_LIBRARY: expected the path of libembree4.so");
    let folder = std::path::Path::new(&library).parent().expect("the library is in a folder").display();
    // The wheel renames the libraries that it carries, so this one is named by its path and finds the others beside it.
    for argument in [library.clone(), format!("-Wl,-rpath,{folder}"), "-Wl,--allow-shlib-undefined".to_owned()] {
        println!("cargo:rustc-link-arg={argument}");
    }
}
