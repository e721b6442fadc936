"""Links that pass through given poses: dyads, four-bars, function generators, cognates, all of them and proved."""
