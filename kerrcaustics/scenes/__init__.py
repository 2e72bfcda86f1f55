"""Pictures of skies, disks and volumes as a camera or an observer sees them."""
