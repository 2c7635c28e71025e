"""Physical effects that a damper or frame model may lack, one file each."""
