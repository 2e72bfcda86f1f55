"""Images of a disc by the limb as a level curve, sheet by sheet."""
