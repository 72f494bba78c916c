//! A known key occurs nowhere outside its own file.
