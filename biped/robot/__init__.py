"""What a biped is: links, joints, contact points, model file, postures; and one concrete run of it."""
